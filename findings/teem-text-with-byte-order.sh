#!/usr/bin/env bash
# unu of teem writes other numbers as text where a byte order is given: 1 becomes 16777216.
#
# Version:   teem-apps 1.12.0~20160122-5 (Debian 12).
# Input:     a NRRD file of the unsigned integers 1 to 4, saved by `unu save` with the encoding `ascii` and `-en big`, the
#            documented option for the byte order of what is written.
# Expected:  1 2 3 4: text has no byte order, so that the option has no effect or is refused.
# Observed:  16777216 33554432 50331648 67108864, the numbers with their bytes reversed, without a message, in the encoding
#            ascii and in the format text alike. The header has no field `endian` then, so that no reader can undo it.
# Matters:   scripts that pass `-en big` to every conversion lose all values when they change to text. Readers see valid text.
. "$(dirname "$0")/lib/packages.sh"
debian teem-apps=1.12.0~20160122-5
printf '1 2 3 4' >"$work/system/tmp/numbers.txt"
within teem-unu make -i /tmp/numbers.txt -t uint -s 4 -e ascii -o /tmp/numbers.nrrd
for order in little big; do
  within teem-unu save -i /tmp/numbers.nrrd -f nrrd -e ascii -en $order -o /tmp/$order.nrrd 2>"$work/error_$order"
  within teem-unu save -i /tmp/numbers.nrrd -f text -en $order -o /tmp/$order.txt >/dev/null 2>&1
done
numbers() { sed '1,/^$/d' "$work/system/tmp/$1.nrrd" | xargs; }
observe 'encoding ascii, -en little' "$(numbers little)" '1 2 3 4'
observe 'encoding ascii, -en big' "$(numbers big)" '16777216 33554432 50331648 67108864'
observe 'format text, -en big' "$(xargs <"$work/system/tmp/big.txt")" '16777216 33554432 50331648 67108864'
observe 'fields of the header about the byte order' "$(grep -c endian "$work/system/tmp/big.nrrd" || true)" 0
observe 'messages' "$(wc -c <"$work/error_big")" 0
exit $differs
