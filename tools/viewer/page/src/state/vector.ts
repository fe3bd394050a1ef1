// Vectors of three numbers.

import type { Json } from "./json";
import type { Vector } from "./protocol";

export function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function times(factor: number, v: Vector): Vector {
  return [factor * v[0], factor * v[1], factor * v[2]];
}

function plus(...list: Vector[]): Vector {
  return list.reduce((sum, v): Vector => [sum[0] + v[0], sum[1] + v[1], sum[2] + v[2]], [0, 0, 0]);
}

export function normalized(v: Vector): Vector {
  return times(1 / (Math.hypot(...v) || 1), v);
}

/** `v` turned by `angle` (radians) about the unit vector `axis`. */
export function turned(v: Vector, axis: Vector, angle: number): Vector {
  const c = Math.cos(angle);
  return plus(times(c, v), times(Math.sin(angle), cross(axis, v)), times((1 - c) * dot(axis, v), axis));
}

/** A unit vector with few digits, for scene files. */
export function rounded(v: Vector): Vector {
  return normalized(v).map((x) => Math.round(x * 1e4) / 1e4 + 0) as Vector;
}

/** The vector that `value` is; null if it is none. */
export function vector_of(value: Json | undefined): Vector | null {
  const fits = Array.isArray(value) && value.length === 3 && value.every((x) => typeof x === "number");
  return fits ? (value as Vector) : null;
}
