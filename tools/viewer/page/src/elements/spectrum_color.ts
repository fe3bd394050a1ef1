// The colour of monochromatic light on a screen, for rainbow strips. An approximation for the eye, not a measurement.

const stops: [number, number, number, number][] = [
  [380, 70, 0, 110], [410, 110, 0, 200], [440, 50, 30, 255], [480, 0, 150, 255], [500, 0, 210, 160],
  [525, 60, 220, 40], [560, 190, 225, 0], [580, 255, 220, 0], [600, 255, 150, 0], [630, 255, 40, 0],
  [680, 210, 0, 0], [780, 80, 0, 0],
];

export function spectrum_color(wavelength: number): string {
  const nm = Math.min(780, Math.max(380, wavelength));
  const i = Math.max(1, stops.findIndex((stop) => stop[0] >= nm));
  const [a, b] = [stops[i - 1]!, stops[i]!];
  const t = (nm - a[0]) / (b[0] - a[0]);
  const mix = (k: 1 | 2 | 3): number => Math.round(a[k] + t * (b[k] - a[k]));
  return `rgb(${mix(1)}, ${mix(2)}, ${mix(3)})`;
}
