# Print make rules that say which object files must be there before a source file is compiled:
#
#   awk -f tools/depends.awk -v build=build/opt -v unit=build/opt/unit src/*/*.f90 tests/unit/*/*
#
# A suite (.pf) becomes a program: it depends on all modules that it uses, and on all that those
# use. Modules of others (iso_c_binding, hdf5, omp_lib) are passed over: only files named on the
# command line and the generated pd_version count.
BEGIN {
  object["pd_version"] = build "/pd_version.o"
  for (i = 1; i < ARGC; i++)
    if (ARGV[i] ~ /\.f90$/)
      object[stem(ARGV[i])] = folder(ARGV[i]) "/" stem(ARGV[i]) ".o"
}

tolower($0) ~ /^[ \t]*use[ \t,:]/ {
  name = used_module($0)
  user = stem(FILENAME)
  if (!(name in object) || name == user || seen[user, name]++) next
  uses[user] = uses[user] " " name
  if (FILENAME ~ /\.pf$/) suites[user] = unit "/" user
  else print object[user] ": " object[name]
}

END {
  for (suite in suites) {
    split("", reached)
    line = suites[suite] ": " closure(suite)
    print line
  }
}

function closure(user,    names, count, i, list) {
  count = split(uses[user], names, " ")
  list = ""
  for (i = 1; i <= count; i++)
    if (!(names[i] in reached)) {
      reached[names[i]] = 1
      list = list " " object[names[i]] closure(names[i])
    }
  return list
}

function folder(path) {
  return path ~ /^tests\// ? unit : build
}

function stem(path) {
  sub(/.*\//, "", path)
  sub(/\.[^.]*$/, "", path)
  return path
}

function used_module(line) {
  line = tolower(line)
  if (line ~ /^[ \t]*use[ \t]*,[ \t]*intrinsic/) return ""
  sub(/^[ \t]*use[ \t]*(,[^:]*)?(::)?[ \t]*/, "", line)
  match(line, /^[a-z0-9_]*/)
  return substr(line, 1, RLENGTH)
}
