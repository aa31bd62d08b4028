/**
 * The shaders of the ray marcher. They follow the library's renderer (libesvr/render: brick_march.h,
 * sample_rule.h, transfer_table.h), whose headers explain the rules; the same names mean the same things.
 *
 * A place in the transfer function's tables counts intervals from the lowest value. Since it depends
 * linearly on the value, rays carry places in place of values.
 */

/** Texels of a row of the tables' textures. */
export const kTableRow = 1024;

/** A triangle that covers the picture. */
export const kVertexShader = `#version 300 es
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

const kDeclarations = `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
precision highp usampler3D;

uniform vec3 uEye, uRight, uUp, uForward;  // relative to the first brick of the table
uniform bool uPerspective;
uniform vec2 uPixel;  // size of a pixel
uniform float uLeft, uTop, uHeight;
uniform vec3 uLow, uHigh;    // all samples outside this box are empty space, or clipped
uniform float uStep, uMinTransmittance;
uniform usampler3D uBricks;  // bytes: the slot's place and 0, or the distance to the next brick
uniform sampler3D uVoxels;   // (value - background) / scale
uniform vec3 uTexel;         // size of a texel of uVoxels
uniform float uPlaceScale, uPlaceOfBackground;
uniform sampler2D uValues;
uniform sampler2D uSegments;
uniform vec2 uSegmentPlaces;  // places of the first and the last row of uSegments
uniform float uSegmentSide;
uniform vec4 uBelow, uAbove;  // color and extinction beyond the ends of the table
uniform vec4 uBackground;    // behind the volume, premultiplied
out vec4 color;

const float kIntervals = 4096.0;
const int kRow = ${kTableRow};
const float kBrickSide = 8.0, kSlotSide = 9.0;
const int kParts = 4;  // of a segment that is divided
`;

const kTransferTable = `
vec4 valueEntry(int i) { return texelFetch(uValues, ivec2(i % kRow, i / kRow), 0); }

// The color and opacity of a value, premultiplied.
vec4 classified(float place) {
  float at = clamp(place, 0.0, kIntervals);
  int i = min(int(at), int(kIntervals) - 1);
  vec4 c = mix(valueEntry(i), valueEntry(i + 1), at - float(i));
  // Below the first value, the first of several points at the same value counts.
  if (!(place > 0.0)) c = valueEntry(0);
  return vec4(c.rgb * c.a, c.a);
}
`;

/** Software renderers compute both sides of a branch, so that rare cases have shaders of their own. */
const kSegmentInTable = `
float absorbed(float t) {
  return t < 1.0 / 64.0 ? t * (1.0 - t * (0.5 - t * (1.0 / 6.0))) : 1.0 - exp(-t);
}

// The light of a share of a segment, as if its values were those of the whole one.
vec4 partOf(vec4 whole, float size) {
  if (!(whole.a > 0.0)) return vec4(0.0);
  float alpha = whole.a < 1.0 ? absorbed(-size * log(1.0 - whole.a)) : 1.0;
  return whole * (alpha / whole.a);
}

// The light of a segment whose values lie in the table.
vec4 segmentInTable(float a, float b) {
  vec2 share = (vec2(a, b) - uSegmentPlaces.x) / (uSegmentPlaces.y - uSegmentPlaces.x);
  return textureLod(uSegments, (share * (uSegmentSide - 1.0) + 0.5) / uSegmentSide, 0.0);
}
`;

const kSegmentBeyondTable = `
// The light of a part of constant value.
vec4 constantPart(vec4 means, float size) {
  if (!(means.a * size > 0.0)) return vec4(0.0);
  float alpha = absorbed(means.a * size);
  return vec4(means.rgb * (alpha / means.a), alpha);
}
vec4 beyond(float place) { return place < 0.0 ? uBelow : uAbove; }

// The light of the segment from a sample to the next. Values beyond the ends of the table have
// constant colors.
vec4 segment(float a, float b) {
  float from = clamp(a, 0.0, kIntervals), to = clamp(b, 0.0, kIntervals);
  vec4 whole = segmentInTable(from, to);
  float all = max(abs(b - a), 1e-6), ahead = min(abs(from - a) / all, 1.0);
  float behind = from == to ? 1.0 - ahead : abs(b - to) / all;
  if (from == a && to == b) return whole;
  vec4 inside = partOf(whole, 1.0 - ahead - behind), last = constantPart(beyond(b), behind);
  vec4 light = constantPart(beyond(a), ahead);
  light += (1.0 - light.a) * inside;
  return light + (1.0 - light.a) * last;
}
`;

const kShading = `
uniform vec3 uToLight;
uniform mat3 uEdges, uRows;  // from directions of the index space, and from gradients there, to the camera's space
uniform float uWeakSquared;  // in places of the table
const float kAmbient = 0.3, kDiffuse = 0.7, kSpecular = 0.25, kShininess = 25.0;

float voxelAt(vec3 local, vec3 slot) { return textureLod(uVoxels, (local + slot) * uTexel, 0.0).r; }

// Factor of the color, and the highlight. The direction is that of the ray in the camera's space.
vec2 shadeAt(vec3 local, vec3 slot, vec3 direction) {
  vec3 low = max(local - 0.5, 0.0), high = min(local + 0.5, kBrickSide);
  vec3 g = uPlaceScale / (high - low) * vec3(
    voxelAt(vec3(high.x, local.yz), slot) - voxelAt(vec3(low.x, local.yz), slot),
    voxelAt(vec3(local.x, high.y, local.z), slot) - voxelAt(vec3(local.x, low.y, local.z), slot),
    voxelAt(vec3(local.xy, high.z), slot) - voxelAt(vec3(local.xy, low.z), slot));
  g = uRows * g;
  float squared = dot(g, g);
  if (!(squared > 0.0)) return vec2(kAmbient + kDiffuse, 0.0);
  float perLength = inversesqrt(squared);
  vec3 halfway = uToLight - direction;
  float facing = abs(dot(g, uToLight)) * perLength;
  float mirrored = abs(dot(g, halfway)) * perLength / max(length(halfway), 1e-6);
  float strength = squared / (squared + uWeakSquared);
  return vec2(kAmbient + kDiffuse * (1.0 + strength * (facing - 1.0)),
              strength * kSpecular * pow(mirrored, kShininess));
}
vec4 lit(vec4 c, vec2 shade) { return vec4(c.rgb * shade.x + shade.y * c.a, c.a); }
`;

/**
 * The state of a ray, and what each mode does with the samples in bricks. A sample whose share is 0 is
 * empty space; so are those between the bricks, which are skipped. add() adds a part of a segment, by its
 * number (RayParts), and returns the number of the next one.
 */
const kModes = {
  maximum: `
float largest;
bool seen = false;
int add(int part, float share, float place) {
  if (share != 0.0) {
    largest = seen ? max(largest, place) : place;
    seen = true;
  }
  return part + kParts;
}
vec4 result() { return seen ? classified(largest) : vec4(0.0); }
`,
  average: `
float total = 0.0, count = 0.0;
int add(int part, float share, float place) {
  if (share != 0.0) {
    total += place;
    ++count;
  }
  return part + kParts;
}
vec4 result() { return count > 0.0 ? classified(total / count) : vec4(0.0); }
`,
  post: `
int add(int part, float share, float place) {
  if (share != 0.0) absorb(LIT(classified(place), nowShade));
  return part + kParts;
}
vec4 result() { return vec4(light, 1.0 - transmittance); }
`,
  pre: `
float lastShare = 0.0, lastPlace, change = 0.0;
bool divided = false;
uniform float uLeastBend;  // in places of the table

bool bends(float from, float place) {
  float bend = abs(place - from - (lastShare != 0.0 ? change : 0.0));
  return bend * transmittance > uLeastBend && min(from, place) - bend < kIntervals &&
         max(from, place) + bend > 0.0;
}
int add(int part, float share, float place) {
  // Nothing is drawn between two samples in empty space.
  if (share != 0.0 || lastShare != 0.0) {
    float from = lastShare != 0.0 ? lastPlace : uPlaceOfBackground;
    if (!divided && bends(from, place)) {
      divided = true;
      return part - kParts + 1;
    }
    vec4 whole = SEGMENT(from, place);
    absorb(LIT((divided ? partOf(whole, 1.0 / float(kParts)) : whole), (share != 0.0 ? nowShade : lastShade)));
    change = (place - from) * (divided ? float(kParts) : 1.0);
  }
  lastShare = share;
  lastPlace = place;
  divided = divided && part % kParts != 0;
  return part + (divided ? 1 : kParts);
}
vec4 result() { return vec4(light, 1.0 - transmittance); }
`,
};

const kComposite = `
vec3 light = vec3(0.0);
float transmittance = 1.0;
void absorb(vec4 c) {
  light += transmittance * c.rgb;
  transmittance *= 1.0 - c.a;
}
`;

const kMarch = `
// The part of a ray between two planes perpendicular to each axis.
vec2 within(vec3 origin, vec3 direction) {
  vec3 safe = mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
  vec3 a = (uLow - origin) / safe, b = (uHigh - origin) / safe;
  vec3 near = min(a, b), far = max(a, b);
  return vec2(max(max(near.x, near.y), max(near.z, 0.0)), min(far.x, min(far.y, far.z)));
}

// Number of samples from a place to the first one outside a cube, at least 1.
int samplesToLeave(vec3 p, vec3 perVoxel, vec3 low, vec3 high) {
  vec3 faces = mix(low, high, greaterThan(perVoxel, vec3(0.0)));
  vec3 ahead = mix((faces - p) * perVoxel, vec3(1e30), equal(perVoxel, vec3(0.0)));
  return int(clamp(ceil(min(ahead.x, min(ahead.y, ahead.z)) - 1e-3), 1.0, 1e9));
}

float sampleOf(int part) { return float(part - kParts) / float(kParts); }

void main() {
  vec2 pixel = vec2(gl_FragCoord.x, uHeight - gl_FragCoord.y);
  float x = uLeft + pixel.x * uPixel.x, y = uTop - pixel.y * uPixel.y;
  vec3 across = uRight * x + uUp * y;
  vec3 origin = uPerspective ? uEye : uEye + across;
  // Of length 1 in the camera's space, where the axes of the picture have this length.
  vec3 direction = uPerspective ? (uForward + across) / sqrt(1.0 + x * x + y * y) : uForward;
  vec2 range = within(origin, direction);
  float first = ceil(range.x / uStep), final = floor(range.y / uStep);
  vec3 start = origin + direction * (first * uStep), apart = direction * uStep;
  vec3 perVoxel = mix(1.0 / apart, vec3(0.0), lessThan(abs(apart), vec3(1e-30)));
  // The sample behind the last one ends the last segment.
  int lastPart = range.x < range.y ? (int(final - first) + 2) * kParts : 0;
  int firstInside = int(ceil((range.x / uStep - first + 1.0) * float(kParts)));
  int lastInside = int(floor((range.y / uStep - first + 1.0) * float(kParts)));
  ivec3 last = textureSize(uBricks, 0) - 1;
  int part = kParts;
  BEGIN
  while (part <= lastPart && OPEN) {
    vec3 p, low;
    uvec4 entry;
    // Software renderers run all of a loop's body for every pixel, so that this loop is a short one.
    while (true) {
      p = start + sampleOf(part) * apart;
      // Rounding can move a place beyond the box.
      ivec3 brick = clamp(ivec3(floor(p / kBrickSide)), ivec3(0), last);
      low = vec3(brick) * kBrickSide;
      entry = texelFetch(uBricks, brick, 0);
      if (entry.a == 0u || !SKIPS) break;
      float room = (float(entry.a) - 1.0) * kBrickSide;
      part += kParts * samplesToLeave(p, perVoxel, low - room, low + kBrickSide + room);
      if (part > lastPart) break;
    }
    if (part > lastPart) break;
    vec3 slot = vec3(entry.xyz) * kSlotSide + 0.5;
    vec3 texel = (start - low + slot) * uTexel, texelsApart = apart * uTexel;
    // The parts of this brick. A ray that divides a segment may go back to the brick before.
    int begin = part, end = begin + samplesToLeave(p, perVoxel * float(kParts), low, low + kBrickSide);
    bool isEmpty = entry.a != 0u;
    end = isEmpty ? begin + 1 : min(end, lastPart + 1);
    while (part >= begin && part < end && OPEN) {
      bool isInside = !isEmpty && part >= firstInside && part <= lastInside;
      float share = isInside ? textureLod(uVoxels, texel + sampleOf(part) * texelsApart, 0.0).r : 0.0;
      SHADE
      part = add(part, share, share * uPlaceScale + uPlaceOfBackground);
      NEXT_SHADE
    }
  }
  color = result();
  color += (1.0 - color.a) * uBackground;
}`;

/**
 * The fragment shader of a kind of picture.
 * @param {import("./ray-marcher.js").Kind} kind
 */
export function fragmentShader({ mode, classification, shade, inTable }) {
  const composite = mode === "composite", isLit = composite && shade;
  const isDivided = composite && classification === "pre";
  const parts = [
    "#version 300 es",
    kDeclarations,
    kTransferTable,
    composite ? kSegmentInTable : "",
    composite && !inTable ? kSegmentBeyondTable : "",
    `#define SEGMENT ${inTable ? "segmentInTable" : "segment"}`,
    isLit ? kShading + "vec2 nowShade, lastShade;" : "",
    `#define LIT(light, shade) ${isLit ? "lit(light, shade)" : "light"}`,
    `#define OPEN ${composite ? "!(transmittance < uMinTransmittance)" : "true"}`,
    `#define BEGIN ${isDivided ? "if (first > final) divided = true, part = 1;" : ""}`,
    `#define SKIPS ${isDivided ? "(lastShare == 0.0 && !divided)" : "true"}`,
    `#define SHADE ${isLit ? "nowShade = shadeAt(clamp(start + sampleOf(part) * apart - low, 0.0, kBrickSide), slot, uEdges * direction);" : ""}`,
    `#define NEXT_SHADE ${isLit ? "lastShade = isInside ? nowShade : lastShade;" : ""}`,
    composite ? kComposite : "",
    kModes[composite ? classification : mode],
    kMarch,
  ];
  return parts.join("\n");
}
