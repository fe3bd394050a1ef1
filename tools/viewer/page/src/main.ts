// The live view: joins the connection, the scene, and the parts of the page.

import "./view.css";
import "uplot/dist/uPlot.min.css";
import { DirectionSphere } from "./controls/direction_sphere";
import { Form } from "./controls/form";
import { by_id } from "./elements/dom";
import { copy, download } from "./elements/files";
import { make_tabs } from "./elements/tabs";
import { Theme } from "./elements/theme";
import { show_toast } from "./elements/toast";
import { Picture } from "./panes/picture";
import { ReadOut } from "./panes/read_out";
import { SpacePane } from "./panes/space_pane";
import { StatusLine } from "./panes/status_line";
import { fragment_of, patch_of } from "./state/address";
import { command_line } from "./state/command_line";
import { Connection } from "./state/connection";
import { apply_patch, type JsonObject } from "./state/json";
import type { BinaryMessage, Failure, FieldInformation, Hello, PictureHeader, Request, TextMessage } from "./state/protocol";
import { State } from "./state/state";
import { Throttle } from "./state/throttle";

const space_interval = 250;  // ms, between requests for the content of the 3D pane
const address_delay = 250;  // ms, before the address shows a change

const state = new State();
const theme = new Theme(by_id<HTMLButtonElement>("theme"));
const picture = new Picture(by_id<HTMLCanvasElement>("picture"), by_id("picture-frame"), by_id("cross-hair"));
const read_out = new ReadOut(by_id("read-out"));
const status_line = new StatusLine();
const form = new Form(by_id("keys"), state);
const space_pane = make_space_pane();

let hello: Hello | null = null;
let shown_field = "";
let sent_scene: JsonObject | null = null;
/** Ids of requests whose errors are told to the user. */
const told_ids = new Set<number | null>();

const connection = new Connection({ on_text, on_binary, on_state: on_connection });

const scenes = new Throttle<JsonObject>((scene) => {
  const id = ask_and_tell({ type: "scene", scene });
  if (id !== null) sent_scene = scene;
  return id;
});
const looks = new Throttle<[number, number]>(([x, y]) => connection.send({ type: "look", x, y }));
const spaces = new Throttle<true>(() => connection.send({ type: "space" }), space_interval);

function ask_and_tell(request: Request): number | null {
  const id = connection.send(request);
  told_ids.add(id);
  return id;
}

function ask_for_look(): void {
  if (picture.mark) looks.ask(picture.mark);
}

function make_space_pane(): SpacePane | null {
  try {
    return new SpacePane(by_id("space-frame"), picture.canvas);
  } catch {
    const frame = by_id("space-frame");
    frame.textContent = "This browser has no WebGL, so there is no view in space.";
    frame.classList.add("hint");
    return null;
  }
}

function on_connection(connected: boolean): void {
  by_id("banner").hidden = connected;
  document.body.classList.toggle("disconnected", !connected);
  for (const queue of [scenes, looks, spaces]) queue.reset();
}

const answers: { [Type in TextMessage["type"]]: (message: Extract<TextMessage, { type: Type }>) => void } = {
  hello: on_hello,
  progress: (message) => status_line.show_progress(message),
  details: ask_for_look,
  error: on_error,
  look: (message) => {
    looks.answered(message.id);
    status_line.settle();
    read_out.show(message);
    space_pane?.show_look(message.rays);
  },
  space: (message) => {
    spaces.answered(message.id);
    status_line.settle();
    if (message.field) on_field(message.field);
    space_pane?.show_space(message, ["photon_distribution", "lens"].includes(rendered_method()));
  },
  saved: (message) => show_toast("Saved as " + message.file),
};

function on_text(message: TextMessage): void {
  (answers[message.type] as (message: TextMessage) => void)(message);
}

function on_binary({ header, content }: BinaryMessage): void {
  if (header.type === "file") download(header.name, content);
  else on_picture(header, content);
}

function on_hello(message: Hello): void {
  const again = hello !== null;
  hello = message;
  by_id("file-name").textContent = message.file;
  by_id("file-name").title = `${message.file}, ${message.field.voxels.join(" × ")} voxels, tensorray ${message.version}`;
  by_id("save").title = message.saves ? "Write the scene to " + message.saves : "Only of a field that stays";
  document.title = message.file.replace(/^.*\//, "") + " – tensorray";
  on_field(message.field);
  if (again) {
    // After a reconnection the user's scene stays.
    state.original = message.scene;
    scenes.ask(state.scene);
    return;
  }
  form.build(message.schema);
  const patch = patch_of(location.hash);
  if (location.hash.length > 1 && !patch) show_toast("The address has no readable scene. The scene of the file is shown.");
  state.begin(message.scene, patch ?? {});
}

/** The field of the scene is another one, if a key of it was changed. */
function on_field(field: FieldInformation): void {
  if (JSON.stringify(field) === shown_field) return;
  shown_field = JSON.stringify(field);
  space_pane?.show_field(field);
}

function on_picture(header: PictureHeader, content: Uint8Array<ArrayBuffer>): void {
  scenes.answered(header.id);
  by_id("picture-waiting").hidden = true;
  status_line.show_picture(header);
  form.show_fault(null);
  state.chosen = header.chosen;
  state.examples = header.examples;
  form.update();
  void picture.draw(header, content).catch(() => status_line.show_error("The picture cannot be decoded."));
  for (const id of ["export-png", "export-exr"]) by_id<HTMLButtonElement>(id).disabled = !header.final;
  if (header.final) {
    spaces.ask(true);
    ask_for_look();
  } else if (header.stage === 0) {
    read_out.age();
    spaces.ask(true);
  }
}

function on_error(failure: Failure): void {
  if (looks.is_outstanding(failure.id)) {
    status_line.settle();
    read_out.show_fault(failure.message);
    space_pane?.show_look([]);
  } else if (told_ids.has(failure.id)) {
    status_line.show_error(failure.message);
    form.show_fault(failure.message);
  }
  for (const queue of [scenes, looks, spaces]) if (queue.is_outstanding(failure.id)) queue.answered(failure.id);
}

function rendered_method(): string {
  const integrator = (sent_scene ?? state.scene)["integrator"] as JsonObject | undefined;
  return String(integrator?.["type"] ?? "");
}

let address_timer = 0;

state.on_change = () => {
  scenes.ask(state.scene);
  form.update();
  by_id<HTMLButtonElement>("undo").disabled = state.past.length === 0;
  by_id<HTMLButtonElement>("redo").disabled = state.future.length === 0;
  clearTimeout(address_timer);
  address_timer = window.setTimeout(() => {
    history.replaceState(null, "", location.pathname + location.search + fragment_of(state.patch()));
  }, address_delay);
};

picture.on_pointer = (x, y) => looks.ask([x, y]);
picture.on_drawn = () => space_pane?.picture_changed();
if (space_pane) {
  space_pane.on_plate = (x, y) => picture.point(x, y);
  space_pane.on_view = DirectionSphere.set_view;
}
theme.on_change = () => {
  read_out.restyle();
  space_pane?.restyle();
  form.update();
};
make_tabs(by_id("tabs"), (tab) => form.show(tab.id === "tab-knobs"));

by_id("undo").addEventListener("click", () => state.undo());
by_id("redo").addEventListener("click", () => state.redo());
by_id("space-reset").addEventListener("click", () => space_pane?.reset_view());
by_id("space-rays").addEventListener("click", (event) => {
  const button = event.currentTarget as HTMLElement;
  const shown = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", String(shown));
  space_pane?.show_rays(shown);
});
by_id("save").addEventListener("click", () => ask_and_tell({ type: "save", scene: state.scene }));
by_id("copy-command").addEventListener("click", () => {
  if (!hello) return;
  const text = command_line(hello.command, state.patch());
  by_id("copy-command").dataset["command"] = text;
  void copy(text).then((done) => show_toast(done ? "Copied: " + text : text));
});
for (const file of ["png", "exr"] as const)
  by_id("export-" + file).addEventListener("click", () => ask_and_tell({ type: "export", file }));

window.addEventListener("hashchange", () => {
  const patch = patch_of(location.hash);
  if (hello && patch) state.replace(apply_patch(state.original, patch));
});

document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
  const key = event.key.toLowerCase();
  // In a text, these keys belong to the browser.
  const target = event.target;
  const in_text = target instanceof HTMLTextAreaElement || (target instanceof HTMLInputElement && target.type !== "range");
  if (in_text || !(key === "z" || key === "y")) return;
  event.preventDefault();
  if (key === "y" || event.shiftKey) state.redo();
  else state.undo();
});
