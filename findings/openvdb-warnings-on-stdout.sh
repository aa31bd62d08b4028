#!/usr/bin/env bash
# The OpenVDB of Debian writes its warnings to standard output, with colours, also into files and pipes.
#
# Version:   OpenVDB 10.0.1-2 (Debian 12), whose library is built with log4cplus, through python3-openvdb.
# Input:     a file of two grids of one name, which a look-up by name answers with a warning.
# Expected:  standard output holds what the program prints; a warning goes to standard error, and escape sequences
#            only to a terminal.
# Observed:  the warning is on standard output, between escape sequences, and standard error is empty. The sequence that
#            ends the colour comes after the line break, so that it begins the next line of the program's own output.
# Matters:   a script that reads numbers or JSON from a program that uses OpenVDB gets warnings among them. A program
#            with data on standard output sets the level of the log (openvdb::logging::setLevel) or its own appender.
. "$(dirname "$0")/lib/packages.sh"
debian python3-openvdb=10.0.1-2
cat >"$work/system/tmp/two.py" <<'P'
import pyopenvdb as vdb
grids = [vdb.FloatGrid(), vdb.FloatGrid()]
for grid in grids:
    grid.name = 'a'
vdb.write('/tmp/two.vdb', grids)
vdb.read('/tmp/two.vdb', 'a')
P
within python3 /tmp/two.py >"$work/out" 2>"$work/error"
observe 'lines with WARN on standard output' "$(grep -c WARN "$work/out")" 2
observe 'escape sequences there' "$(tr -cd '\033' <"$work/out" | wc -c)" 4
observe 'bytes on standard error' "$(wc -c <"$work/error")" 0
exit $differs
