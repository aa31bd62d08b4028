/**
 * ParaView's JSON presets. They are read by the backend.
 * @typedef {import("../types.js").Transfer} Transfer
 */

const kNanColor = [0.5, 0, 0];

/** The text of a preset file. @param {Transfer} transfer @param {string} name */
export function paraViewText({ space, colors, opacity }, name) {
  const preset = {
    Name: name,
    ColorSpace: space === "HSVWrap" ? "HSV" : space,
    ...(space === "HSVWrap" && { HSVWrap: true }),
    NanColor: kNanColor,
    RGBPoints: colors.flat(),
    Points: opacity.flat(),
  };
  return JSON.stringify([preset], null, 2) + "\n";
}
