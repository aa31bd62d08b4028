#!/usr/bin/env bash
# The NRRD loader of three.js gives other values, without a message, where a header has `byte skip`, `endian: big` or `hex`.
#
# Version:   three 0.187.0 (npm), examples/jsm/loaders/NRRDLoader.js.
# Input:     a volume of 3 x 1 x 1 values of the type ushort, 258, 3 and 4, as NRRD files that differ in fields of the format's
#            definition: `encoding: raw` with `endian: little`; the same with `byte skip: 4` and four more bytes before the
#            values, which writers leave for a foreign header; with `endian: big`; and `encoding: hex`, two digits a byte. teem 1.12.0
#            (`unu save -f nrrd -e ascii`) gives 258 3 4 of each.
# Expected:  258 3 4 from each file, or an error: a loader that does not know a field cannot know the values.
# Observed:  258 3 4 from the first one only. The bytes that should be skipped are the first values, and there are more values
#            than the sizes say; big-endian values have their bytes reversed, since the field is used nowhere; and a line of
#            hex digits is taken for one number, of which the lowest 16 bits are left, and the other values are 0.
# Matters:   pages that show scans show noise, or nothing, of files that teem reads, and a measurement
#            taken there is wrong. Convert to raw or gzip, little-endian, with the data behind the header, for the web.
. "$(dirname "$0")/lib/packages.sh"
version=0.187.0
if ! command -v node >/dev/null ||
  ! npm install --silent --no-save --prefix "$work" "three@$version" >"$work/npm.log" 2>&1; then
  echo "not available: Node and three@$version" >&2
  exit 2
fi
cat >"$work/read.mjs" <<'J'
import { NRRDLoader } from 'three/examples/jsm/loaders/NRRDLoader.js';
const [fields, digits] = process.argv.slice(2);
const header = ['NRRD0004', 'type: ushort', 'dimension: 3', 'sizes: 3 1 1', ...fields.split(';')].join('\n') + '\n\n';
const data = fields.includes('hex') ? Buffer.from(digits) : Buffer.from(digits, 'hex');
const file = Buffer.concat([Buffer.from(header), data]);
const volume = new NRRDLoader().parse(file.buffer.slice(file.byteOffset, file.byteOffset + file.length));
console.log([...volume.data].join(' '));
J
values() { node "$work/read.mjs" "$@" 2>&1; }
observe 'little-endian' "$(values 'encoding: raw;endian: little' 020103000400)" '258 3 4'
observe 'bytes before the values' "$(values 'encoding: raw;endian: little;byte skip: 4' 07000800020103000400)" '7 8 258 3 4'
observe 'big-endian' "$(values 'encoding: raw;endian: big' 010200030004)" '513 768 1024'
observe 'hex digits' "$(values 'encoding: hex;endian: little' 020103000400)" '1024 0 0'
exit $differs
