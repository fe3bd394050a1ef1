// Numbers as text.

/** At most `digits` significant digits, without trailing zeros. Integers are written in full. */
export function short_text(value: number, digits = 4): string {
  if (Number.isInteger(value)) return String(value);
  return String(Number(value.toPrecision(digits)));
}

/** `value` with at most `digits` significant digits, for scene files. */
export function trimmed(value: number, digits = 4): number {
  return Number(value.toPrecision(digits));
}
