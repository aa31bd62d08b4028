/** Light, dark, or as the system says. The choice is kept by the browser. */

const kKey = "esvr-theme";
export const kThemes = /** @type {const} */ (["system", "light", "dark"]);

/** @returns {string} */
export function storedTheme() {
  try {
    return localStorage.getItem(kKey) ?? "system";
  } catch {
    return "system"; // browsers may refuse to store anything
  }
}

/** @param {string} theme */
export function applyTheme(theme) {
  document.documentElement.dataset.theme = theme;
  try {
    localStorage.setItem(kKey, theme);
  } catch {
    // The theme then lasts as long as the page.
  }
}
