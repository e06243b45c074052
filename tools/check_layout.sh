# Check the layout of text files:  sh tools/check_layout.sh FILE...
#
# No tabs but in a Makefile, no blanks at the end of a line, at most 100 columns. In a suite an
# assert has to stand on one line, so that Fortran's own limit holds there; a link in a text may be
# as long as it is.
awk '
  FNR == 1 {
    limit = 100
    if (FILENAME ~ /\.pf$/) limit = 132
    if (FILENAME ~ /\.(md|cff)$/ || FILENAME ~ /(^|\/)LICENSE$/) limit = 100000
    tabs = FILENAME ~ /(^|\/)Makefile$/
  }
  length($0) > limit {
    print FILENAME ":" FNR ": " length($0) " columns; at most " limit
    bad = 1
  }
  /[ \t\r]$/ { print FILENAME ":" FNR ": blanks at the end of the line"; bad = 1 }
  /\t/ && !tabs { print FILENAME ":" FNR ": a tab"; bad = 1 }
  END { exit bad }
' "$@"
