// The 3D pane: field, plate with its picture, beam, meshes, bent rays and camera. It is drawn when something changes.

import * as three from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { axis_colors, style_value } from "../elements/dom";
import type { FieldInformation, Mesh, Ray, Space, Vector } from "../state/protocol";

const view_from: Record<"y" | "z", Vector> = { y: [0.9, 0.75, 1.5], z: [0.9, -1.5, 0.75] };  // by the axis that is up
const margin = 0.08;  // of the pane, about the content
const click_distance = 4;  // pixels

export class SpacePane {
  /** Called with picture coordinates, 0 to 1, from the top left. */
  on_plate: (x: number, y: number) => void = () => undefined;
  /** Called with the axes of the view. */
  on_view: (right: Vector, up: Vector, toward: Vector) => void = () => undefined;

  private readonly renderer: three.WebGLRenderer;
  private readonly scene = new three.Scene();
  private readonly camera = new three.PerspectiveCamera(35, 1, 0.01, 100);
  private controls: OrbitControls;
  private readonly field_group = new three.Group();
  private readonly space_group = new three.Group();
  private readonly look_group = new three.Group();
  private readonly texture: three.CanvasTexture;
  private plate: three.Mesh | null = null;
  private field_sphere = new three.Sphere(new three.Vector3(), 1);
  private field: FieldInformation | null = null;
  private space: Space | null = null;
  private meshes: Mesh[] = [];
  private look_rays: Ray[] = [];
  private shows_picture = true;
  private rays_shown = true;
  private wanted = false;
  /** The user has turned the view, so it stays as it is. */
  private turned = false;

  /** @throws Error if the browser has no WebGL. */
  constructor(private readonly frame: HTMLElement, private readonly picture: HTMLCanvasElement) {
    this.renderer = new three.WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "Field, plate and rays in space. Drag or ctrl and arrow keys turn the view, wheel or + and - zoom, arrow keys move it.");
    frame.prepend(canvas);

    this.texture = new_texture(picture);
    this.camera.up.set(0, 0, 1);
    const lamp = new three.DirectionalLight("#ffffff", 2);
    lamp.position.set(0.5, 0.7, 1);
    this.camera.add(lamp);
    this.scene.add(this.camera, new three.AmbientLight("#ffffff", 1.2));
    this.scene.add(this.field_group, this.space_group, this.look_group);

    this.controls = this.new_controls();
    this.listen_for_clicks(canvas);
    canvas.addEventListener("keydown", (event) => {
      const factor = { "+": 0.87, "=": 0.87, "-": 1.15 }[event.key];
      if (!factor || event.ctrlKey || event.metaKey) return;
      this.turned = true;
      this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
      this.controls.update();
    });
    new ResizeObserver(() => this.resize()).observe(frame);
  }

  /** They keep the camera's up of this moment. */
  private new_controls(): OrbitControls {
    const controls = new OrbitControls(this.camera, this.renderer.domElement);
    controls.listenToKeyEvents(this.renderer.domElement);
    controls.addEventListener("start", () => (this.turned = true));
    controls.addEventListener("change", () => {
      this.tell_view();
      this.request();
    });
    return controls;
  }

  show_field(field: FieldInformation): void {
    const tilts = field.y_up !== this.camera.up.y > 0;
    if (tilts) {
      this.camera.up.set(0, field.y_up ? 1 : 0, field.y_up ? 0 : 1);
      this.controls.dispose();
      this.controls = this.new_controls();
    }
    const first = this.field === null;
    this.field = field;
    this.field_sphere = new three.Box3()
      .setFromPoints(field.corners.map((corner) => new three.Vector3(...corner)))
      .getBoundingSphere(new three.Sphere());
    this.build_field();
    if (first || tilts) this.reset_view();
    this.request();
  }

  /** @param shows_picture  The picture is that of the plate. */
  show_space(space: Space, shows_picture: boolean): void {
    const first = this.space === null;
    this.space = space;
    if (space.meshes) this.meshes = space.meshes;
    this.shows_picture = shows_picture;
    this.build_space();
    if (first && !this.turned) this.reset_view();
    this.request();
  }

  show_look(rays: Ray[]): void {
    this.look_rays = rays;
    clear(this.look_group);
    if (rays.length > 0) {
      // A wide line in the colour of the page below makes the ray visible before others.
      this.look_group.add(wide_lines(rays, 6, style_value("--surface-3d")), wide_lines(rays, 3, null));
    }
    this.request();
  }

  picture_changed(): void {
    // The size of the picture may have changed, so the texture is made again.
    this.texture.dispose();
    this.texture.needsUpdate = true;
    this.request();
  }

  show_rays(shown: boolean): void {
    this.rays_shown = shown;
    this.build_space();
    this.request();
  }

  restyle(): void {
    this.build_field();
    this.build_space();
    this.show_look(this.look_rays);
  }

  reset_view(): void {
    const points = this.points();
    if (points.length === 0) return;
    const center = new three.Box3().setFromPoints(points).getCenter(new three.Vector3());
    const toward = new three.Vector3(...view_from[this.camera.up.y > 0 ? "y" : "z"]).normalize();
    const right = this.camera.up.clone().cross(toward).normalize();
    const up = toward.clone().cross(right);
    const half_height = Math.tan((this.camera.fov * Math.PI) / 360) * (1 - margin);
    const half_width = half_height * this.camera.aspect;
    // The least distance from which every point is seen.
    const distance = Math.max(
      ...points.map((point) => {
        const from_center = point.clone().sub(center);
        const [x, y] = [Math.abs(from_center.dot(right)), Math.abs(from_center.dot(up))];
        return from_center.dot(toward) + Math.max(x / half_width, y / half_height);
      }),
    );
    this.camera.position.copy(center).addScaledVector(toward, distance);
    this.camera.near = distance / 200;
    this.camera.far = distance * 50;
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(center);
    this.controls.update();
    this.tell_view();
    this.request();
  }

  /** Points about field, plate and beam. */
  private points(): three.Vector3[] {
    const beam = this.space?.beam;
    return [...(this.field?.corners ?? []), ...(this.space?.plate ?? []), ...(beam ? circle_of(beam) : [])].map(
      (point) => new three.Vector3(...point),
    );
  }

  private tell_view(): void {
    this.camera.updateMatrixWorld();
    const [right, up, toward] = [new three.Vector3(), new three.Vector3(), new three.Vector3()];
    this.camera.matrixWorld.extractBasis(right, up, toward);
    this.on_view(right.toArray(), up.toArray(), toward.toArray());
  }

  private request(): void {
    if (this.wanted) return;
    this.wanted = true;
    requestAnimationFrame(() => {
      this.wanted = false;
      this.renderer.render(this.scene, this.camera);
    });
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.frame;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.turned && this.field) this.reset_view();
    this.request();
  }

  private listen_for_clicks(canvas: HTMLCanvasElement): void {
    let start: [number, number] = [0, 0];
    canvas.addEventListener("pointerdown", (event) => (start = [event.clientX, event.clientY]));
    canvas.addEventListener("pointerup", (event) => {
      const moved = Math.hypot(event.clientX - start[0], event.clientY - start[1]);
      if (moved > click_distance || !this.plate) return;
      const box = canvas.getBoundingClientRect();
      const [x, y] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
      const caster = new three.Raycaster();
      caster.setFromCamera(new three.Vector2(2 * x - 1, 1 - 2 * y), this.camera);
      const uv = caster.intersectObject(this.plate)[0]?.uv;
      if (uv) this.on_plate(uv.x, 1 - uv.y);
    });
  }

  private build_field(): void {
    clear(this.field_group);
    if (!this.field) return;
    const corners = this.field.corners;
    const edges: Vector[] = [];
    for (let i = 0; i < 8; ++i)
      for (const bit of [1, 2, 4]) if ((i & bit) === 0) edges.push(corners[i]!, corners[i | bit]!);
    this.field_group.add(thin_lines(edges.flat(), style_value("--ink-quiet")));

    const origin = new three.Vector3(...(corners[0] ?? [0, 0, 0]));
    const size = this.field_sphere.radius * 0.3;
    for (const [i, [name, color]] of Object.entries(axis_colors).entries()) {
      const tip = origin.clone().setComponent(i, origin.getComponent(i) + size);
      this.field_group.add(wide_lines([{ points: [origin.toArray(), tip.toArray()], color }], 2.5, null));
      const letter = label(name, color, size * 0.45);
      letter.position.copy(tip).setComponent(i, tip.getComponent(i) + size * 0.2);
      this.field_group.add(letter);
    }
  }

  private build_space(): void {
    clear(this.space_group);
    this.plate = null;
    const space = this.space;
    if (!space) return;
    if (space.plate?.length === 4) this.add_plate(space.plate);
    if (space.beam) this.add_beam(space.beam);
    for (const mesh of this.meshes) {
      const geometry = geometry_of(mesh.positions, mesh.triangles);
      geometry.computeVertexNormals();
      const limits = /body|bounds/i.test(mesh.name);
      const material = new three.MeshStandardMaterial({
        color: limits ? "#7d92b5" : "#a08a6c", roughness: 0.8, side: three.DoubleSide,
        transparent: true, opacity: limits ? 0.25 : 0.75, depthWrite: !limits,
      });
      this.space_group.add(new three.Mesh(geometry, material));
    }
    if (space.rays.length > 0 && this.rays_shown) {
      const { positions, colors } = pieces_of(space.rays);
      this.space_group.add(thin_lines(positions, colors));
    }
    if (space.camera) this.add_camera(space.camera);
  }

  private add_plate(corners: Vector[]): void {
    const geometry = geometry_of(corners.flat(), [0, 1, 2, 0, 2, 3]);
    geometry.setAttribute("uv", new three.Float32BufferAttribute([0, 0, 1, 0, 1, 1, 0, 1], 2));
    const material = this.shows_picture
      ? new three.MeshBasicMaterial({ map: this.texture, side: three.DoubleSide, toneMapped: false })
      : new three.MeshBasicMaterial({ color: "#888888", side: three.DoubleSide, transparent: true, opacity: 0.3 });
    const mesh = new three.Mesh(geometry, material);
    if (this.shows_picture) this.plate = mesh;
    const outline = [0, 1, 1, 2, 2, 3, 3, 0].flatMap((i): Vector[] => (corners[i] ? [corners[i]] : []));
    this.space_group.add(mesh, thin_lines(outline.flat(), style_value("--ink-quiet")));
  }

  private add_beam(beam: NonNullable<Space["beam"]>): void {
    const color = style_value("--beam");
    const direction = new three.Vector3(...beam.direction).normalize();
    const origin = new three.Vector3(...beam.origin);
    const size = this.field_sphere.radius * 0.6;
    const arrow = new three.ArrowHelper(direction, origin, size, color, size * 0.28, size * 0.16);
    const circle = circle_of(beam);
    const lines = circle.flatMap((point, i): Vector[] => [point, circle[(i + 1) % circle.length]!]);
    this.space_group.add(arrow, thin_lines(lines.flat(), color));
  }

  private add_camera(view: NonNullable<Space["camera"]>): void {
    const eye = new three.Vector3(...view.eye);
    const forward = new three.Vector3(...view.target).sub(eye).normalize();
    const right = forward.clone().cross(new three.Vector3(...view.up)).normalize();
    const up = right.clone().cross(forward);
    const depth = this.field_sphere.radius * 0.4;
    const half = depth * Math.tan((view.fov * Math.PI) / 360);
    const aspect = this.picture.width / this.picture.height;
    const corner = (x: number, y: number): Vector =>
      eye.clone().addScaledVector(forward, depth).addScaledVector(right, x * half * aspect).addScaledVector(up, y * half)
        .toArray();
    const ring = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    const lines = ring.flatMap((point, i): Vector[] => [eye.toArray(), point, point, ring[(i + 1) % 4]!]);
    this.space_group.add(thin_lines(lines.flat(), style_value("--accent")));
  }
}

/** Points on the edge of the beam, where it starts. */
function circle_of(beam: NonNullable<Space["beam"]>): Vector[] {
  const direction = new three.Vector3(...beam.direction).normalize();
  const start = Math.abs(direction.z) < 0.9 ? new three.Vector3(0, 0, 1) : new three.Vector3(1, 0, 0);
  const side = start.cross(direction).normalize();
  const other = direction.clone().cross(side);
  const count = 64;
  return Array.from({ length: count }, (_, i) => {
    const angle = (2 * Math.PI * i) / count;
    return new three.Vector3(...beam.origin)
      .addScaledVector(side, beam.radius * Math.cos(angle))
      .addScaledVector(other, beam.radius * Math.sin(angle))
      .toArray();
  });
}

function new_texture(canvas: HTMLCanvasElement): three.CanvasTexture {
  const texture = new three.CanvasTexture(canvas);
  texture.colorSpace = three.SRGBColorSpace;
  texture.minFilter = three.LinearFilter;
  texture.generateMipmaps = false;
  return texture;
}

/** Removes everything from `group` and frees it. The texture of the plate stays. */
function clear(group: three.Group): void {
  for (const child of [...group.children]) {
    group.remove(child);
    child.traverse((node) => {
      if (node instanceof three.Sprite) node.material.map?.dispose();
      if (node instanceof three.Mesh || node instanceof three.Line || node instanceof three.Sprite) {
        node.geometry.dispose();
        (node.material as three.Material).dispose();
      }
    });
  }
}

/** Lines between pairs of points, in one colour, or in one for each point. */
function thin_lines(ends: number[], color: string | number[]): three.LineSegments {
  const geometry = geometry_of(ends, null);
  if (typeof color === "string") return new three.LineSegments(geometry, new three.LineBasicMaterial({ color }));
  geometry.setAttribute("color", new three.Float32BufferAttribute(color, 3));
  const material = new three.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.8 });
  return new three.LineSegments(geometry, material);
}

function geometry_of(positions: number[], triangles: number[] | null): three.BufferGeometry {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.Float32BufferAttribute(positions, 3));
  return geometry.setIndex(triangles);
}

/** Positions and colours of the rays' pieces, for lines. */
function pieces_of(rays: Ray[]): { positions: number[]; colors: number[] } {
  const positions: number[] = [];
  const colors: number[] = [];
  for (const ray of rays) {
    const color = new three.Color(ray.color).toArray();
    for (let i = 1; i < ray.points.length; ++i) {
      positions.push(...ray.points[i - 1]!, ...ray.points[i]!);
      colors.push(...color, ...color);
    }
  }
  return { positions, colors };
}

/** Lines of `width` pixels; in the colours of the rays, or in `color`. */
function wide_lines(rays: Ray[], width: number, color: string | null): LineSegments2 {
  const { positions, colors } = pieces_of(rays);
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(positions);
  if (color === null) geometry.setColors(colors);
  const material = new LineMaterial({ linewidth: width, vertexColors: color === null, depthTest: false, transparent: true });
  if (color !== null) material.color.set(color);
  const lines = new LineSegments2(geometry, material);
  lines.renderOrder = color === null ? 3 : 2;
  return lines;
}

function label(text: string, color: string, size: number): three.Sprite {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const context = canvas.getContext("2d");
  if (context) {
    context.font = "bold 48px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillStyle = color;
    context.fillText(text, 32, 30);
  }
  const sprite = new three.Sprite(new three.SpriteMaterial({ map: new_texture(canvas), depthTest: false }));
  sprite.scale.setScalar(size);
  return sprite;
}
