// The messages between the page and the server.

import type { Json, JsonObject } from "./json";

export type Vector = [number, number, number];

/** The connection adds an `id`, which the answers have. */
export type Request =
  | { type: "scene"; scene: JsonObject }
  | { type: "look"; x: number; y: number }
  | { type: "space" }
  | { type: "save"; scene: JsonObject }
  | { type: "export"; file: "png" | "exr" };

export interface FieldInformation {
  voxels: Vector;
  /** World; bit 0 of the index is x, bit 1 is y, bit 2 is z. */
  corners: Vector[];
  /** Else z is up. */
  y_up: boolean;
}

export interface Hello {
  type: "hello";
  version: string;
  scene: JsonObject;
  schema: JsonObject;
  /** The path of the file, as the user gave it. */
  file: string;
  /** Where "save" writes. */
  saves: string;
  /** The program and its arguments that render the scene. */
  command: string[];
  field: FieldInformation;
}

export type Progress = { type: "progress"; id: number; phase: string; done: number; total: number };

/** Spectrum and maps of the last picture can be asked for now. */
export type Details = { type: "details"; id: number };
export type Failure = { type: "error"; id: number; message: string };
export type Ray = { points: Vector[]; color: string };

export interface Look {
  type: "look";
  id: number;
  lines: [string, string][];
  color: string | null;
  spectrum: { nm: number[]; values: number[] } | null;
  rays: Ray[];
}

export type Mesh = { name: string; positions: number[]; triangles: number[] };

export interface Space {
  type: "space";
  id: number;
  /** Corners: bottom left, bottom right, top right and top left of the picture. */
  plate: Vector[] | null;
  beam: { origin: Vector; direction: Vector; radius: number } | null;
  /** null: those of the last answer. */
  meshes: Mesh[] | null;
  rays: Ray[];
  camera: { eye: Vector; target: Vector; up: Vector; fov: number } | null;
  /** The field, which a change of the scene may replace. */
  field?: FieldInformation;
}

export type Saved = { type: "saved"; id: number; file: string };

export type TextMessage = Hello | Progress | Details | Failure | Look | Space | Saved;

export interface PictureHeader {
  type: "picture";
  id: number;
  /** 0 is the coarsest. */
  stage: number;
  final: boolean;
  width: number;
  height: number;
  /** Of the finished picture. */
  full_width: number;
  full_height: number;
  format: string;
  seconds: number;
  /** A part of a scene: values that were used where the scene leaves them open. */
  chosen: JsonObject;
  /** Names that keys may have, in the place of their values. */
  examples: JsonObject;
  notes?: string[];
  warnings?: string[];
}

export type FileHeader = { type: "file"; id: number; name: string };

export type BinaryMessage = { header: PictureHeader | FileHeader; content: Uint8Array<ArrayBuffer> };

/** Splits a binary message: the length of the header (4 bytes, little-endian), the header as JSON, the content. */
export function parse_binary(data: ArrayBuffer): BinaryMessage {
  const length = new DataView(data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))) as Json;
  return { header: header as unknown as BinaryMessage["header"], content: new Uint8Array(data, 4 + length) };
}
