// Drives a browser over the page of a live view, and starts and kills the view itself:
//   node test/page_test.mjs PROGRAM SCENE [FOLDER FOR SCREENSHOTS]
// PROGRAM is `tensorray-view`. Prints a line for each check. Exit code 1: a check failed.
import { execFileSync, spawn } from "node:child_process";
import { copyFileSync, existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { mkdir } from "node:fs/promises";
import { tmpdir } from "node:os";
import { basename, dirname, join } from "node:path";
import puppeteer from "puppeteer-core";

const [program, scene, pictures] = process.argv.slice(2);
if (!program || !scene) {
  console.error("usage: node test/page_test.mjs PROGRAM SCENE [FOLDER]");
  process.exit(2);
}

const folder = mkdtempSync(join(tmpdir(), "tensorray_page_"));
const scene_copy = join(folder, basename(scene));
copyFileSync(scene, scene_copy);
// Small pictures: the test is of the page, not of the renderer.
const settings = ["--set", "receiver.resolution=[192,192]", "--set", "light.wavelengths.count=8", "--quiet"];
const browser_paths = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
let server;

/** Starts the view. @returns the address that it prints. */
function start_server(more = []) {
  server = spawn(program, [scene_copy, ...settings, ...more], {
    stdio: ["ignore", "pipe", "inherit"],
    env: { ...process.env, XDG_STATE_HOME: folder },
  });
  return new Promise((resolve, reject) => {
    server.stdout.once("data", (data) => resolve(String(data).trim()));
    server.once("exit", (status) => reject(new Error("the view ended with status " + status)));
  });
}

const patience = { timeout: 240000, polling: 50 };
let failures = 0;

async function check(name, body) {
  try {
    await body();
    console.log("passed: " + name);
  } catch (error) {
    ++failures;
    console.log("FAILED: " + name + ": " + String(error?.message ?? error).split("\n")[0]);
  }
}

function expect(condition, message) {
  if (!condition) throw new Error(message);
}

const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM ?? browser_paths.find(existsSync),
  headless: true,
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});

/** A new tab. What goes wrong in it is added to `faults`. */
async function open(url, faults, size = { width: 1280, height: 720 }) {
  const page = await browser.newPage();
  page.setDefaultTimeout(patience.timeout);
  await page.setViewport(size);
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => {
    if (message.type() === "error") faults.push(message.text());
  });
  page.on("requestfailed", (request) => {
    // The download of a file is refused below.
    if (!request.url().startsWith("blob:")) faults.push(request.url() + ": " + request.failure()?.errorText);
  });
  page.on("response", (response) => {
    if (response.status() >= 400) faults.push(response.url() + ": " + response.status());
  });
  const session = await page.createCDPSession();
  await session.send("Page.setDownloadBehavior", { behavior: "deny" });
  await page.goto(url);
  return page;
}

/** Waits for a finished picture that is newer than picture `after`. @returns its number. */
async function finished(page, after = 0) {
  await page.waitForFunction(
    (id) => {
      const canvas = document.querySelector("#picture");
      return canvas.dataset.final === "true" && Number(canvas.dataset.picture) > id;
    },
    patience,
    after,
  );
  return page.$eval("#picture", (canvas) => Number(canvas.dataset.picture));
}

/** A number for the pixels of the picture. Equal pictures have equal numbers. */
function checksum(page) {
  return page.$eval("#picture", (canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let sum = 17;
    for (let i = 0; i < data.length; ++i) sum = (Math.imul(sum, 31) + data[i]) | 0;
    return sum;
  });
}

const text = (page, selector) => page.$eval(selector, (node) => node.value ?? node.textContent);
const settled = (page) => new Promise((resolve) => setTimeout(resolve, 500)).then(() => page.evaluate(() => location.hash));

/** Drags the knob of the slider `selector` to `part` (0 to 1) of its length. */
async function drag_slider(page, selector, part) {
  await page.$eval(selector, (node) => node.scrollIntoView({ block: "center" }));
  const box = await (await page.$(selector)).boundingBox();
  const now = await page.$eval(selector, (node) => (node.value - node.min) / (node.max - node.min));
  const thumb = 16;
  const x = (value) => box.x + thumb / 2 + value * (box.width - thumb);
  const y = box.y + box.height / 2;
  await page.mouse.move(x(now), y);
  await page.mouse.down();
  await page.mouse.move(x(part), y, { steps: 12 });
  await page.mouse.up();
}

const address = await start_server();
const faults = [];
const page = await open(address, faults);
let first = 0;
let original = 0;

await check("the first picture appears", async () => {
  first = await finished(page);
  original = await checksum(page);
  expect(await page.$eval("#picture-waiting", (node) => node.hidden), "the page still waits");
  expect((await text(page, "#status-stage")).startsWith("Finished"), "the status line does not say that it is finished");
});

await check("the knobs show the scene", async () => {
  expect((await text(page, "#key-field-scale-number")) !== "", "the scale is not shown");
  expect((await text(page, "#key-integrator-type")) !== "", "the method is not shown");
  expect(await page.$eval("#undo", (node) => node.disabled), "there is something to undo");
});

let changed = 0;
let changed_scale = "";
const original_scale = await text(page, "#key-field-scale-number");

await check("a drag of the scale changes the picture", async () => {
  const start = await page.$eval("#key-field-scale", (node) => node.value / node.max);
  await drag_slider(page, "#key-field-scale", start > 0.5 ? start - 0.15 : start + 0.15);
  changed_scale = await text(page, "#key-field-scale-number");
  expect(changed_scale !== original_scale, "the scale is the same");
  await finished(page, first);
  await page.waitForFunction(() => document.querySelector("#status-stage").textContent.startsWith("Finished"), patience);
  changed = await checksum(page);
  expect(changed !== original, "the picture is the same");
});

await check("a reload restores the scene", async () => {
  expect((await settled(page)).length > 1, "the address has no fragment");
  await page.reload();
  await finished(page);
  expect((await text(page, "#key-field-scale-number")) === changed_scale, "the scale is another");
  expect((await checksum(page)) === changed, "the picture is another");
});

await check("a drag is one step of undo, and redo repeats it", async () => {
  const before = await text(page, "#key-field-scale-number");
  const picture = Number(await page.$eval("#picture", (node) => node.dataset.picture));
  await drag_slider(page, "#key-field-scale", 0.35);
  const after = await text(page, "#key-field-scale-number");
  expect(after !== before, "the drag has no effect");
  await page.click("#undo");
  expect((await text(page, "#key-field-scale-number")) === before, "undo does not bring the old scale back");
  expect(await page.$eval("#undo", (node) => node.disabled), "the drag was more than one step");
  await page.click("#redo");
  expect((await text(page, "#key-field-scale-number")) === after, "redo does not bring the new scale back");
  await page.focus("#undo");
  await page.keyboard.down("Control");
  await page.keyboard.press("z");
  await page.keyboard.up("Control");
  expect((await text(page, "#key-field-scale-number")) === before, "ctrl-Z has no effect");
  await finished(page, picture);
  await settled(page);
  await page.waitForFunction(() => document.querySelector("#picture").dataset.final === "true", patience);
});

await check("the command line has the change", async () => {
  await page.click("#copy-command");
  const command = await page.$eval("#copy-command", (node) => node.dataset.command);
  expect(/tensorray render \S+/.test(command), "it is " + command);
  expect(command.includes("--set field.scale="), "it is " + command);
});

await check("the direction of light turns", async () => {
  const before = await text(page, "#key-light-direction-text");
  const picture = Number(await page.$eval("#picture", (node) => node.dataset.picture));
  await page.focus("#key-light-direction");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowUp");
  expect((await text(page, "#key-light-direction-text")) !== before, "the arrow keys have no effect");
  await page.click('[data-key="light.direction"] [data-snap="-x"]');
  expect((await text(page, "#key-light-direction-text")).trim().startsWith("−1"), "the button has no effect");
  await finished(page, picture);
  await page.click("#undo");
  await page.click("#undo");
  expect((await text(page, "#key-light-direction-text")) === before, "undo does not bring the direction back");
});

await check("the flexibility follows the keys", async () => {
  const before = await text(page, "#key-bending-a-number");
  await page.$eval("#flexibility-0", (node) => node.focus());
  await page.keyboard.press("ArrowUp");
  expect((await text(page, "#key-bending-a-number")) !== before, "a is the same");
  await page.click("#undo");
});

await check("what is under the pointer is read out", async () => {
  const box = await (await page.$("#picture")).boundingBox();
  await page.mouse.move(box.x + box.width * 0.45, box.y + box.height * 0.55, { steps: 5 });
  await page.waitForFunction(() => document.querySelectorAll("#read-out-values dt").length > 0, patience);
  expect(!(await page.$eval("#cross-hair", (node) => node.hidden)), "no mark is shown");
});

await check("the 3D pane is drawn", async () => {
  expect((await page.$$("#space-frame canvas")).length === 1, "there is no 3D view");
});

await check("all keys has every key of the schema", async () => {
  await page.click("#tab-all-keys");
  const keys = await page.$$eval("#keys [data-key]", (nodes) => nodes.map((node) => node.dataset.key));
  expect(keys.length > 100, `there are ${keys.length} keys`);
  for (const key of ["light.photons", "receiver.size", "integrator.seeds.kind", "output.exposure", "obstacles"]) {
    expect(keys.includes(key), key + " is missing");
  }
});

await check("the filter of all keys finds a key, and its row changes the scene", async () => {
  await page.type("#keys-filter", "photons light");
  const row = '[data-key="light.photons"]';
  expect(!(await page.$eval(row, (node) => node.hidden)), "the key is not found");
  expect(await page.$eval('[data-key="camera"]', (node) => node.hidden), "other keys are shown");
  const box = row + " .number, " + row + " input[type=text]";
  const enter = async (text) => {
    await page.$eval(box, (node) => (node.value = ""));
    await page.type(box, text + "\n");
  };
  await enter("0.5");
  await page.waitForSelector(row + " .fault:not([hidden])", patience);
  await enter("65536");
  expect(await page.$eval(row, (node) => !node.classList.contains("absent")), "the key is still absent");
  await page.waitForSelector(row + " .fault[hidden]", patience);
  await page.click(row + " .reset");
  expect(await page.$eval(row, (node) => node.classList.contains("absent")), "the key is not removed");
  await page.click("#tab-knobs");
  expect((await page.$$("#keys details:not([open])")).length === 0, "sections of the knobs are closed");
});

await check("PNG hands out a file", async () => {
  await page.evaluate(() => {
    const make = URL.createObjectURL.bind(URL);
    URL.createObjectURL = (content) => {
      window.handed_out = content.size;
      return make(content);
    };
  });
  await page.waitForSelector("#export-png:not(:disabled)");
  await page.click("#export-png");
  await page.waitForFunction(() => window.handed_out > 100, patience);
});

await check("two pages work at the same time", async () => {
  const second = await open(address, faults);
  const picture = await finished(second);
  expect((await text(second, "#key-field-scale-number")) === original_scale, "the second page does not show the original scene");
  expect((await checksum(second)) === original, "the second page shows another picture");
  await drag_slider(second, "#key-field-scale", 0.3);
  await finished(second, picture);
  expect((await text(page, "#key-field-scale-number")) === changed_scale, "the first page has changed");
  await second.close();
});

await check("the picture is the one of `tensorray render` of the saved scene", async () => {
  await page.click("#save");
  const saved = scene_copy.replace(/\.json$/, ".view.json");
  for (let i = 0; i < 100 && !existsSync(saved); ++i) await settled(page);
  const rendered = join(folder, "rendered.png");
  execFileSync(join(dirname(program), "tensorray"), ["render", saved, "-o", rendered, "-o", join(folder, "rendered.exr"), "-q"]);
  const difference = await page.evaluate(async (data) => {
    const image = new Image();
    image.src = data;
    await image.decode();
    const shown = document.querySelector("#picture");
    if (image.width !== shown.width || image.height !== shown.height) return Infinity;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    canvas.getContext("2d").drawImage(image, 0, 0);
    const [a, b] = [shown, canvas].map((c) => c.getContext("2d").getImageData(0, 0, c.width, c.height).data);
    return a.reduce((greatest, value, i) => Math.max(greatest, Math.abs(value - b[i])), 0);
  }, "data:image/png;base64," + readFileSync(rendered).toString("base64"));
  // The file has 16 bits; the browser makes 8 of them without rounding, the view with it.
  expect(difference <= 1, `values differ by ${difference} of 255`);
});

await check("a spectrum is shown where the pointer is", async () => {
  await page.waitForFunction(() => document.querySelectorAll("#read-out-values dt").length > 4, patience);
  expect((await page.$$("#read-out-plot canvas")).length > 0, "there is no plot");
});

await check("the view lives on if a page ends during a render", async () => {
  const second = await open(address, []);
  await second.waitForSelector("#key-field-scale");
  await drag_slider(second, "#key-field-scale", 0.4);
  await second.close();
  const third = await open(address, []);
  await finished(third);
  await third.close();
});

await check("a view that was killed and started again is found again", async () => {
  const before = faults.length;
  const port = new URL(address).port;
  const ended = new Promise((resolve) => server.once("exit", resolve));
  server.kill("SIGKILL");
  await ended;
  await page.waitForFunction(() => !document.querySelector("#banner").hidden, patience);
  const picture = Number(await page.$eval("#picture", (node) => node.dataset.picture));
  await drag_slider(page, "#key-field-scale", 0.45);
  const scale = await text(page, "#key-field-scale-number");
  expect((await start_server(["--port", port])) === address, "the address is another one");
  await page.waitForFunction(() => document.querySelector("#banner").hidden, patience);
  await finished(page, picture);
  expect((await text(page, "#key-field-scale-number")) === scale, "the change was lost");
  faults.length = before;  // Connections that failed meanwhile are in the console.
});

if (pictures) {
  await mkdir(pictures, { recursive: true });
  for (const [width, height] of [[1280, 720], [1024, 768], [768, 1024]]) {
    for (const scheme of ["light", "dark"]) {
      await page.bringToFront();
      await page.setViewport({ width, height });
      await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
      await settled(page);
      await page.screenshot({ path: join(pictures, `${width}x${height}_${scheme}.png`) });
    }
  }
}

await check("there are no errors in the console", async () => {
  expect(faults.length === 0, faults.join("; "));
});

await browser.close();
server.kill();
rmSync(folder, { recursive: true, force: true });
process.exit(failures > 0 ? 1 : 0);
