// Addresses of pages.

/** The address of a comparison of designs, each given by its source and key. */
export function compareAddress(...designs: [string, string][]): string {
  return `#/compare/${designs.map((pair) => pair.map(encodeURIComponent).join("/")).join("/")}`;
}
