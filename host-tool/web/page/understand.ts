// The part "Understand": four subparts, each of which is mounted when it is first shown.

import { mountAccuracy } from "./accuracy";
import { Simulator } from "./api";
import { make } from "./dom";
import { mountPulse } from "./pulse";
import { mountStability } from "./stability";
import { mountTrain } from "./train";

interface Subpart {
  name: string;
  title: string;
  mount: (root: HTMLElement, simulator: Simulator) => void;
}

const SUBPARTS: Subpart[] = [
  { name: "pulse", title: "A pulse", mount: mountPulse },
  { name: "train", title: "A pulse train", mount: mountTrain },
  { name: "accuracy", title: "Accuracy and speed", mount: mountAccuracy },
  { name: "stability", title: "Stability", mount: mountStability },
];

export function mountUnderstand(root: HTMLElement, simulator: Simulator): void {
  const mounted = new Map<string, { link: HTMLAnchorElement; panel: HTMLElement }>();
  const links = make("nav", { "aria-label": "Parts of Understand", class: "subparts" });
  root.append(links);
  for (const { name, title } of SUBPARTS) {
    const link = make("a", { href: `#understand/${name}` }, title);
    const panel = make("div", { class: "subpart", hidden: true });
    links.append(link);
    root.append(panel);
    mounted.set(name, { link, panel });
  }

  const show = (): void => {
    if (root.hidden) {
      return;
    }
    const word = location.hash.split("/")[1];
    const shown = SUBPARTS.find((subpart) => subpart.name === word) ?? SUBPARTS[0];
    for (const subpart of SUBPARTS) {
      const entry = mounted.get(subpart.name);
      if (!entry) {
        continue;
      }
      entry.panel.hidden = subpart !== shown;
      entry.link.toggleAttribute("aria-current", subpart === shown);
      if (subpart === shown) {
        entry.link.setAttribute("aria-current", "page");
        if (!entry.panel.hasChildNodes()) {
          entry.panel.append(make("h2", {}, subpart.title));
          subpart.mount(entry.panel, simulator);
        }
      }
    }
  };

  document.addEventListener("part", show);
  show();
}
