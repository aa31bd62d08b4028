#!/usr/bin/env bash
# splat-transform reads splats from wrong bytes where a PLY file has an element before its vertices, or is text.
#
# Version:   @playcanvas/splat-transform 3.7.0 (npm), with Node 20.20.2; the package asks for Node 22.
# Input:     two splats at (1, 2, 3) and (4, 5, 6) as PLY files: binary with vertices only; the same with an element
#            `camera` of two floats, 7 and 8, behind the vertices, and before them; and as text (`format ascii 1.0`). All
#            are valid, since a header says how many bytes its elements take.
# Expected:  the same two splats from each file, or an error.
# Observed:  the camera before the vertices is taken for x and y of the first splat, and each number of the file for the
#            property two places behind its own, so that the splats are at (7, 8, 1) and (0, 0, 4). The bytes of text are
#            taken for those of floats. Both times, the exit code is 0, and there is no warning. Behind the vertices, the
#            camera does no harm.
# Matters:   the converted splats look like noise, or are gone, and the original may have been deleted. Write splats as
#            binary little-endian PLY with the vertices first, as esvr2vdb does, and compare a position after a conversion.
. "$(dirname "$0")/lib/packages.sh"
version=3.7.0
if ! command -v node >/dev/null || ! npm install --silent --no-save --prefix "$work" \
  "@playcanvas/splat-transform@$version" >"$work/npm.log" 2>&1; then
  echo "not available: Node and @playcanvas/splat-transform@$version" >&2
  exit 2
fi
cat >"$work/write.js" <<'J'
const fs = require('fs');
const names = ['x', 'y', 'z', 'f_dc_0', 'f_dc_1', 'f_dc_2', 'opacity', 'scale_0', 'scale_1', 'scale_2',
  'rot_0', 'rot_1', 'rot_2', 'rot_3'];
const look = [0.25, 0.5, 0.75, 2, -3, -4, -5, 1, 0, 0, 0];
const splats = [[1, 2, 3, ...look], [4, 5, 6, ...look]];
const bytes = numbers => Buffer.from(new Float32Array(numbers).buffer);
const vertices = `element vertex 2\n${names.map(name => `property float ${name}\n`).join('')}`;
const camera = 'element camera 1\nproperty float width\nproperty float height\n';
const file = (format, elements) => Buffer.from(`ply\nformat ${format} 1.0\n${elements}end_header\n`);
const binary = elements => file('binary_little_endian', elements);
const numbers = bytes(splats.flat()), seven = bytes([7, 8]);
const folder = process.argv[2];
fs.writeFileSync(`${folder}/alone.ply`, Buffer.concat([binary(vertices), numbers]));
fs.writeFileSync(`${folder}/behind.ply`, Buffer.concat([binary(vertices + camera), numbers, seven]));
fs.writeFileSync(`${folder}/before.ply`, Buffer.concat([binary(camera + vertices), seven, numbers]));
const text = splats.map(splat => splat.map(n => n.toFixed(3)).join(' ') + '\n').join('');
fs.writeFileSync(`${folder}/text.ply`, Buffer.concat([file('ascii', vertices), Buffer.from(text)]));
J
node "$work/write.js" "$work"

# The exit code, and x, y and z of both splats after a conversion to CSV with three significant digits.
positions() {
  local code=0
  node "$work/node_modules/.bin/splat-transform" -w "$work/$1.ply" "$work/$1.csv" >"$work/log" 2>&1 || code=$?
  printf 'exit %d:' $code
  [ ! -e "$work/$1.csv" ] || tail -n +2 "$work/$1.csv" | awk -F, '{ printf " (%.3g, %.3g, %.3g)", $1, $2, $3 }'
}
observe 'vertices only' "$(positions alone)" 'exit 0: (1, 2, 3) (4, 5, 6)'
observe 'an element behind the vertices' "$(positions behind)" 'exit 0: (1, 2, 3) (4, 5, 6)'
observe 'an element before the vertices' "$(positions before)" 'exit 0: (7, 8, 1) (0, 0, 4)'
observe 'text' "$(positions text)" 'exit 0: (6.41e-10, 4.05e-11, 1.49e-19) (6.34e-10, 2.33e-09, 6.41e-10)'
exit $differs
