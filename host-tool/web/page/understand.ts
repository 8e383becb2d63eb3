// The part "Understand": four subparts, each of which is loaded and mounted when it is first shown.

import { Simulator } from "./api";
import { make } from "./dom";

type Mount = (root: HTMLElement, simulator: Simulator) => void;

interface Subpart {
  name: string;
  title: string;
  load: () => Promise<Mount>;
}

const SUBPARTS: Subpart[] = [
  { name: "pulse", title: "A pulse", load: async () => (await import("./pulse")).mountPulse },
  {
    name: "train",
    title: "A pulse train",
    load: async () => (await import("./train")).mountTrain,
  },
  {
    name: "accuracy",
    title: "Accuracy and speed",
    load: async () => (await import("./accuracy")).mountAccuracy,
  },
  {
    name: "stability",
    title: "Stability",
    load: async () => (await import("./stability")).mountStability,
  },
];

export function mountUnderstand(root: HTMLElement, simulator: Simulator): void {
  const links = make("nav", { "aria-label": "Parts of Understand", class: "subparts" });
  root.append(links);
  const entries = SUBPARTS.map((subpart) => {
    const link = make("a", { href: `#understand/${subpart.name}` }, subpart.title);
    const panel = make("div", { class: "subpart", hidden: true });
    links.append(link);
    root.append(panel);
    return { subpart, link, panel };
  });

  const fill = async (subpart: Subpart, panel: HTMLElement): Promise<void> => {
    panel.append(make("h2", {}, subpart.title));
    try {
      const mount = await subpart.load();
      mount(panel, simulator);
    } catch (error) {
      const text = `This part could not be loaded: ${(error as Error).message}`;
      panel.append(make("p", { class: "trouble", role: "alert" }, text));
    }
  };

  const show = (): void => {
    if (root.hidden) {
      return;
    }
    const name = location.hash.split("/")[1];
    const shown = SUBPARTS.find((subpart) => subpart.name === name) ?? SUBPARTS[0];
    for (const { subpart, link, panel } of entries) {
      panel.hidden = subpart !== shown;
      if (panel.hidden) {
        link.removeAttribute("aria-current");
        continue;
      }
      link.setAttribute("aria-current", "page");
      if (!panel.hasChildNodes()) {
        void fill(subpart, panel);
      }
    }
  };

  document.addEventListener("part", show);
  show();
}
