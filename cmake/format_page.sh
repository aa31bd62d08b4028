#!/usr/bin/env bash
# format_page.sh VERSION FORMAT.md PAGE.1...: prints the man page esvr(5). It has the text of the
# document, and names the programs with the summaries of their own pages.
set -euo pipefail
version=$1 document=$2 pages=("${@:3}")

# The summary "vdb2esvr \- Fits ellipsoids" of a page becomes an item of a list.
programs() {
  zcat -f "${pages[@]}" | grep -A1 '^\.SH NAME' | sed -nE 's/^([a-z0-9\\-]+) \\- (.*)/- \1(1): \2/p' |
    sed 's/\\-/-/g'
}

# Headings begin one level higher, and links within the document are text.
markdown() {
  printf '# NAME\n\nesvr - the file format of ESVR, sparse volumes as ellipsoids\n\n# DESCRIPTION\n'
  sed -e '1d' -e 's/^### /## /' "$document" |
    sed -zE 's/\[([^][]*)\]\(#[^)]*\)/\1/g; s/\[([^][]*)\]\(([^)]*)\)/\1 (\2)/g'
  printf '\n# PROGRAMS\n\n'
  programs
}

# The last column of a table takes the width that the others leave, and code is bold, because a
# terminal has one family of fonts.
adjusted() {
  sed -zE -e 's/tab\(\|\) expand allbox;/tab(|) allbox nowarn;/g' -e 's/\\fC/\\fB/g' \
    -e 's/\.S([HS])\n([^\n]*)\n\.(LP|PP)\n/.S\1\n\2\n/g' \
    -e 's/(lb)\n(l[ l]*)\.\n/lbx\n\2x.\n/g' \
    -e 's/T\{\n([^\n]*)\nT\}\|/\1|/g' -e 's/\n\.SH\n([A-Z]+)/\n.SH \1/g'
}

printf "'\\\\\" t\n"
markdown | lowdown -s -Tman --out-no-smarty --parse-no-super --parse-no-intraemph \
  -m title=ESVR -m section=5 -m volume=ESVR -m source="esvr $version" | adjusted
