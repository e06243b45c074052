# Write standard input to the file named, unless the file holds the same already: what depends on
# it is then not rebuilt.
new=$1.new
cat > "$new"
if cmp -s "$new" "$1"; then rm -f "$new"; else mv -f "$new" "$1"; fi
