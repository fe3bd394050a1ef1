// Where the plate is if the scene does not say so, and its tilt.

import type { Vector } from "./protocol";
import { dot, normalized, plate_axes, plus, times } from "./vector";

/** Extent of the box with these corners along `axis`. */
function extent(corners: Vector[], axis: Vector): number {
  const heights = corners.map((corner) => dot(corner, axis));
  return Math.max(...heights) - Math.min(...heights);
}

/** The default distance: a quarter of the volume's depth along the light. */
export function default_distance(corners: Vector[], direction: Vector): number {
  return extent(corners, normalized(direction)) / 4;
}

/** The default size: 1.25 times the extent of the beam, which is about that of the volume. */
export function default_size(corners: Vector[], direction: Vector, up: Vector | null): [number, number] {
  const axes = plate_axes(direction, up);
  return [1.25 * extent(corners, axes.right), 1.25 * extent(corners, axes.up)];
}

/** Length of the volume's diagonal. */
export function diagonal(corners: Vector[]): number {
  return Math.hypot(extent(corners, [1, 0, 0]), extent(corners, [0, 1, 0]), extent(corners, [0, 0, 1]));
}

/** Angles (degrees) by which the normal is tilted to the right and upwards from the direction against the light. */
export interface Tilt {
  right: number;
  up: number;
}

const degree = Math.PI / 180;

export function tilt_of(normal: Vector, direction: Vector, up: Vector | null): Tilt {
  const axes = plate_axes(direction, up);
  // The opposite normal gives the same plate.
  const sign = dot(normal, direction) > 0 ? -1 : 1;
  const along = -sign * dot(normal, normalized(direction));
  return {
    right: Math.atan2(sign * dot(normal, axes.right), along) / degree,
    up: Math.atan2(sign * dot(normal, axes.up), along) / degree,
  };
}

export function normal_of(tilt: Tilt, direction: Vector, up: Vector | null): Vector {
  const axes = plate_axes(direction, up);
  return normalized(
    plus(
      times(-1, normalized(direction)),
      times(Math.tan(tilt.right * degree), axes.right),
      times(Math.tan(tilt.up * degree), axes.up),
    ),
  );
}
