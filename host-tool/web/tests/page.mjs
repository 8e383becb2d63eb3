// The page in a real browser, as people use it:
// node page.mjs --tools DIR --page DIR [--shots DIR] [--only WORD]

import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { attempt, check, finish, launch, load, options, serve } from "./browser.mjs";
import { overlaps, unreadable } from "./layout.mjs";

const WIDTHS = [360, 768, 1280];
const PARTS = ["watch", "sessions/reciprocal", "understand/pulse", "understand/train", "understand/accuracy", "understand/stability"];
const BOUND_MS = 15_000;
const only = options.only ?? "";

const browser = await launch();
const server = await serve(options.page);
const problems = [];

// Opens the page in a context of its own, and notes whatever goes wrong in it.
async function open(fragment = "", settings = {}, url = server.url) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...settings });
  const page = await context.newPage();
  page.setDefaultTimeout(BOUND_MS);
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
  page.on("request", (request) => {
    const allowed = [server.url, "file:", "blob:", "data:"].some((start) => request.url().startsWith(start));
    if (!allowed) {
      problems.push(`request to ${request.url()}`);
    }
  });
  await page.goto(url + (fragment ? `#${fragment}` : ""));
  return page;
}

async function test(name, run) {
  if (!name.includes(only)) {
    return;
  }
  problems.length = 0;
  let page = null;
  await attempt(name, async () => {
    const told = await run(async (...more) => (page = await open(...more)));
    return told || problems.join("; ");
  });
  await page?.context().close();
}

// Simulated time of the first part, s; 0 before it begins.
const now = () => Number(document.querySelector("#watch-part [role=status]")?.textContent.split(" ")[0] ?? 0);
const seconds = (page) => page.evaluate(now);
const watch = (page) => page.locator("#watch-part");
const angle = async (page, place = 0) => {
  const text = await page.locator(".finger-figure figcaption").nth(place).textContent();
  return Number(text.match(/: (-?\d+)°/)[1]);
};
const until = (page, condition, argument) => page.waitForFunction(condition, argument, { timeout: BOUND_MS });
const setSlider = (page, label, value) =>
  page.getByLabel(label, { exact: false }).first().evaluate((input, value) => {
    input.value = String(value);
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }, value);
const time = "#watch-part [role=status]";
const playTo = (page, s) =>
  until(page, ([time, s]) => Number(document.querySelector(time)?.textContent.split(" ")[0] ?? 0) >= s, [time, s]);

await test("the first moving picture comes within two seconds or is printed", async (open) => {
  const begun = Date.now();
  const page = await open();
  await until(page, () => {
    const bones = document.querySelector(".bone");
    return bones && bones.getAttribute("points") !== "96,78 142.0,78.0 176.0,78.0";
  });
  await playTo(page, 0.1);
  console.log(`note: first moving picture after ${Date.now() - begun} ms`);
});

await test("play, pause, step and start again", async (open) => {
  const page = await open();
  await playTo(page, 0.5);
  await page.getByRole("button", { name: "Pause" }).click();
  await page.waitForTimeout(300);
  const paused = await seconds(page);
  await page.waitForTimeout(400);
  if ((await seconds(page)) !== paused) {
    return "time goes on while paused";
  }
  for (let i = 0; i < 10; i++) {
    await page.getByRole("button", { name: "Step" }).click();
    await page.waitForTimeout(60);
  }
  const stepped = (await seconds(page)) - paused;
  if (!(stepped > 0.1 && stepped < 0.4)) {
    return `ten steps took ${stepped} s`;
  }
  await page.getByRole("button", { name: "Start again" }).click();
  await until(page, ([time, s]) => Number(document.querySelector(time).textContent.split(" ")[0]) < s, [time, paused]);
});

await test("the speed changes how fast time passes", async (open) => {
  const page = await open();
  await watch(page).getByLabel("Speed").selectOption("0.05");
  await page.waitForTimeout(300);
  const from = await seconds(page);
  await page.waitForTimeout(5000);
  const slow = (await seconds(page)) - from;
  return slow > 0.05 && slow < 0.6 ? "" : `at 1/20, ${slow} s passed in five seconds`;
});

await test("one wanted angle is reached, and a disturbance bends the finger", async (open) => {
  const page = await open();
  await page.getByLabel("Wanted angle", { exact: true }).selectOption("hold");
  await setSlider(page, "Middle of the sine", 60);
  await watch(page).getByLabel("Speed").selectOption("4");
  await playTo(page, 4);
  const reached = await angle(page);
  if (Math.abs(reached - 60) > 4) {
    return `${reached}° instead of 60°`;
  }
  const from = await seconds(page);
  await setSlider(page, "Disturbance", 100);
  let largest = 0;
  for (let i = 0; i < 10 && (await seconds(page)) < from + 2; i++) {
    largest = Math.max(largest, Math.abs((await angle(page)) - 60));
    await page.waitForTimeout(40);
  }
  return largest > 4 ? "" : `the disturbance moved the finger by ${largest}° only`;
});

await test("three controllers run side by side and end apart", async (open) => {
  const page = await open();
  await page.getByLabel("paper's law").check();
  await page.getByLabel("PID").check();
  await watch(page).getByLabel("Speed").selectOption("4");
  await until(page, () => document.querySelectorAll(".finger-figure").length === 3);
  await playTo(page, 4);
  const lines = await page.locator(".u-legend .u-series").count();
  return lines >= 4 ? "" : `${lines} lines in the legend`;
});

await test("sliders of the setup start the session again, and a refused one says why", async (open) => {
  const page = await open();
  await playTo(page, 0.5);
  for (const [label, value] of [["Pulse rate", 40], ["Strength", 60], ["Delay", 80], ["Phase", 4000]]) {
    await setSlider(page, label, value);
    await page.waitForTimeout(400);
    await playTo(page, 0.2);
  }
  await setSlider(page, "Amplitude of channels 4 to 10", 14);
  await page.locator("#watch-part .trouble:not([hidden])").waitFor();
  const told = await page.locator("#watch-part .trouble").textContent();
  if (!/E\d{3}/.test(told) || !told.includes("14")) {
    return told;
  }
  const from = await seconds(page);
  await setSlider(page, "Amplitude of channels 4 to 10", 10);
  await playTo(page, from + 0.5);
  return (await page.locator("#watch-part .trouble").isVisible()) ? "the refusal stays" : "";
});

await test("lost references change the motion, the same way each time", async (open) => {
  const page = await open();
  await setSlider(page, "References lost", 90);
  await watch(page).getByLabel("Speed").selectOption("4");
  await playTo(page, 3);
});

await test("the table of amplitudes has ten channels", async (open) => {
  const page = await open();
  await playTo(page, 1);
  const rows = await page.locator("#watch-part details tbody tr").count();
  return rows === 10 ? "" : `${rows} rows`;
});

await test("a session is chosen, run and downloaded as a record", async (open) => {
  const page = await open("sessions/reciprocal");
  await page.getByText("No mistakes").waitFor();
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator("#sessions-part").getByLabel("Speed").selectOption("Infinity");
  const button = page.getByRole("button", { name: /Download record/ });
  await button.waitFor();
  const [download] = await Promise.all([page.waitForEvent("download"), button.click()]);
  return download.suggestedFilename().endsWith(".zip") ? "" : download.suggestedFilename();
});

await test("a changed session runs, and its mistakes are told at their place", async (open) => {
  const page = await open("sessions/open_finger");
  await page.getByText("No mistakes").waitFor();
  const text = page.getByRole("textbox", { name: /Text of the session/ });
  await text.focus();
  await page.keyboard.press("Control+Home");
  await page.keyboard.type("title_ = 1\n");
  await page.locator("#sessions-part").getByText(/E402/).first().waitFor();
  const told = await page.locator("#sessions-part").textContent();
  return told.includes("title_") ? "" : "the field is not named";
});

await test("a session in a link is shown, and not run by itself", async (open) => {
  const page = await open("sessions/open_finger");
  await page.getByText("No mistakes").waitFor();
  await page.getByRole("button", { name: "Link to share" }).click();
  const link = await page.getByLabel("Link", { exact: true }).inputValue();
  await page.goto("about:blank");
  await page.goto(link);
  await page.getByText(/No mistakes: "Trains on a finger, open loop"/).waitFor();
  const bad = link.slice(0, -30);
  await page.goto("about:blank");
  await page.goto(bad);
  await page.locator("#sessions-part .trouble:not([hidden])").first().waitFor();
});

await test("markup in a title stays text", async (open) => {
  const page = await open("sessions/open_finger");
  await page.getByText("No mistakes").waitFor();
  const text = page.getByRole("textbox", { name: /Text of the session/ });
  await text.focus();
  await page.keyboard.press("Control+A");
  const toml = 'title = "<img src=x onerror=window.hacked=1>"\nduration_s = 0.5\n[[channel]]\nnumber = 1\nname = "<b>x</b>"\n'
    + 'stage = { kind = "current", full_scale_ma = 100.0 }\nlimit = 8.0\ntrain = { shape = "biphasic-cathodic-first", '
    + 'width_us = 200, frequency_hz = 20.0 }\n[setpoints]\nkind = "amplitudes"\nvalues = [{ channel = 1, value = 5.0 }]\nrate_hz = 20\n';
  await page.evaluate((toml) => {
    const data = new DataTransfer();
    data.setData("text/plain", toml);
    document.activeElement.dispatchEvent(new ClipboardEvent("paste", { clipboardData: data, bubbles: true, cancelable: true }));
  }, toml);
  await page.getByText(/No mistakes/).waitFor();
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.getByRole("button", { name: /Download record/ }).waitFor();
  const hacked = await page.evaluate(() => window.hacked ?? document.querySelector("main img, main b b"));
  return hacked ? "markup was interpreted" : "";
});

await test("a text of 100 MB is refused in place", async (open) => {
  const page = await open("sessions/open_finger");
  await page.getByText("No mistakes").waitFor();
  await page.evaluate(() => {
    const input = document.querySelector("#sessions-part input[type=file]");
    const data = new DataTransfer();
    data.items.add(new File(["x".repeat(100 << 20)], "big.toml"));
    input.files = data.files;
    input.dispatchEvent(new Event("change", { bubbles: true }));
  });
  await page.locator("#sessions-part .trouble:not([hidden])").first().waitFor();
  const told = await page.locator("#sessions-part .trouble:not([hidden])").first().textContent();
  return told.includes("MB") ? "" : told;
});

await test("a record of a newer program and a broken draws.csv are told in place", async (open) => {
  const page = await open("sessions/open_finger");
  await page.getByText("Replay a random wearer of a study").click();
  const files = page.getByLabel("Files", { exact: true });
  const told = page.locator("#sessions-part details .trouble:not([hidden])");
  const file = (name, text) => ({ name, mimeType: "text/plain", buffer: Buffer.from(text) });
  await files.setInputFiles([file("run.json", '{ "format": 99, "seed": 1 }')]);
  await told.filter({ hasText: "newer program" }).waitFor();
  await files.setInputFiles([file("draws.csv", "unit,wearer,condition,peak_deg\n0,0\n")]);
  await told.filter({ hasText: "row 1" }).waitFor();
});

await test("a browser without WebAssembly is told", async () => {
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.addInitScript(() => delete window.WebAssembly);
  await page.goto(server.url);
  await page.locator("#trouble:not([hidden])").waitFor({ timeout: BOUND_MS });
  const told = await page.locator("#trouble").textContent();
  await context.close();
  return told.includes("WebAssembly") ? "" : told;
});

await test("the page of one file works by double click, twice at once", async (open) => {
  const url = pathToFileURL(join(options.page, "playground.html")).href;
  const page = await open("", {}, url);
  const other = await page.context().newPage();
  await other.goto(url);
  await playTo(page, 0.3);
  await playTo(other, 0.3);
});

await test("a tab in the background waits and says so", async (open) => {
  const page = await open();
  await playTo(page, 0.5);
  await page.evaluate(() => {
    Object.defineProperty(document, "hidden", { value: true, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  });
  await page.getByText("waited while this tab was in the background").waitFor();
});

await test("a pulse beyond a limit is refused by its rule", async (open) => {
  const page = await open("understand/pulse");
  await page.getByText("The device accepts this pulse").waitFor();
  const width = page.getByLabel(/Width of a phase/);
  await width.fill("500");
  await width.dispatchEvent("change");
  await page.getByLabel(/Amplitude \(mA\)/).fill("45");
  await page.getByText(/E45\d/).first().waitFor();
});

await test("a train, a method and a map show their simulation", async (open) => {
  const page = await open("understand/train");
  await page.locator("#understand-part .uplot canvas").first().waitFor();
  await page.goto(`${server.url}#understand/accuracy`);
  await page.getByLabel("Method", { exact: true }).waitFor();
  await page.locator("#understand-part").getByText(/cycles/).first().waitFor();
  await page.goto(`${server.url}#understand/stability`);
  await page.getByLabel("Map", { exact: true }).waitFor();
  await page.locator("#understand-part").getByText(/holds|fails/).first().waitFor();
});

await test("everything is reached by keyboard alone", async (open) => {
  const page = await open();
  await playTo(page, 0.3);
  const reached = new Set();
  for (let i = 0; i < 45; i++) {
    await page.keyboard.press("Tab");
    reached.add(await page.evaluate(() => {
      const e = document.activeElement;
      return e.labels?.[0]?.textContent?.trim() || e.textContent?.trim() || e.tagName;
    }));
  }
  const wanted = ["Skip to the content", "Sessions", "Pause", "Step 20 ms", "paper's law", "Pulse rate", "References lost"];
  const missed = wanted.filter((word) => ![...reached].some((text) => text.includes(word)));
  return missed.length ? `not reached: ${missed.join(", ")}` : "";
});

await test("reduced motion starts paused", async (open) => {
  const page = await open("", { reducedMotion: "reduce" });
  await page.getByRole("button", { name: "Play" }).waitFor();
});

// Accessibility and layout of every part, at three widths, in light and dark.
for (const part of PARTS) {
  for (const scheme of ["light", "dark"]) {
    await test(`${part} in ${scheme}: accessible, readable, nothing overlaps`, async (open) => {
      const page = await open(part, { colorScheme: scheme });
      await page.waitForTimeout(800);
      // The policy of the page allows no script from outside; a test may add one.
      await page.evaluate(load("axe-core").source);
      const found = [];
      for (const width of WIDTHS) {
        await page.setViewportSize({ width, height: 900 });
        await page.waitForTimeout(250);
        const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
        if (wide > 0) {
          found.push(`${width} px: ${wide} px too wide`);
        }
        found.push(...(await page.evaluate(overlaps)).map((text) => `${width} px: ${text}`));
        found.push(...(await page.evaluate(unreadable)).map((text) => `${width} px: ${text}`));
        if (options.shots) {
          mkdirSync(options.shots, { recursive: true });
          const name = `${part.replaceAll("/", "-")}-${scheme}-${width}.png`;
          await page.screenshot({ path: join(options.shots, name), fullPage: true });
        }
      }
      const { violations } = await page.evaluate(() => window.axe.run());
      found.push(...violations.map((v) => `axe ${v.id}: ${v.nodes[0].target} (${v.nodes.length})`));
      return found.slice(0, 6).join("; ");
    });
  }
}

await test("printed, the page has no controls and fits", async (open) => {
  const page = await open();
  await playTo(page, 1);
  const pdf = await page.pdf({ format: "A4" });
  return pdf.length > 10_000 ? "" : `${pdf.length} bytes`;
});

server.close();
await browser.close();
finish();
