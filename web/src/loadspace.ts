// The view in space, whose bundle is loaded when it is needed.

import type { Section } from "./drawing";
import type { SpaceDrawing } from "./space";

/** Load the view in space. */
export async function loadSpace(label: string, section: Section): Promise<SpaceDrawing> {
  const module = await import("./space.js");
  try {
    return new module.SpaceDrawing(label, section);
  } catch {
    throw new Error("this browser shows no WebGL, which the view in space needs");
  }
}
