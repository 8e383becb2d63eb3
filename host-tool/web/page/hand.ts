// A drawn index finger whose middle joint has the simulated angle. The last joint bends with it for
// the look of the picture only; it is not simulated.

const NAMESPACE = "http://www.w3.org/2000/svg";
const DEG = Math.PI / 180;

// Lengths of the picture, in its own units.
const BASE = { x: 96, y: 78 };
const MIDDLE = 46;
const TIP = 34;
// Share of the middle joint's angle by which the last joint is drawn.
const TIP_SHARE = 0.6;

function element(name: string, attributes: Record<string, string>): SVGElement {
  const made = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) {
    made.setAttribute(key, value);
  }
  return made;
}

// Points of the two outer bones at an angle.
function points(deg: number): string {
  const first = deg * DEG;
  const second = (deg + deg * TIP_SHARE) * DEG;
  const x1 = BASE.x + MIDDLE * Math.cos(first);
  const y1 = BASE.y + MIDDLE * Math.sin(first);
  const x2 = x1 + TIP * Math.cos(second);
  const y2 = y1 + TIP * Math.sin(second);
  const round = (value: number): string => value.toFixed(1);
  return `${BASE.x},${BASE.y} ${round(x1)},${round(y1)} ${round(x2)},${round(y2)}`;
}

export class Finger {
  readonly element: HTMLElement;
  private readonly bones: SVGElement;
  private readonly edge: SVGElement;
  private readonly wanted: SVGElement;
  private readonly caption: HTMLElement;

  constructor(private readonly name: string) {
    const drawing = element("svg", { viewBox: "0 0 200 180", class: "finger", "aria-hidden": "true" });
    const palm = "M4,62 L60,60 L96,70 L96,88 L60,100 L34,128 L4,124 Z";
    drawing.append(element("path", { d: palm, class: "skin" }));
    this.edge = element("polyline", { class: "bone-edge", points: points(0) });
    this.bones = element("polyline", { class: "bone", points: points(0) });
    this.wanted = element("polyline", { class: "bone-wanted", points: points(0) });
    drawing.append(this.edge, this.bones, this.wanted);
    this.caption = document.createElement("figcaption");
    this.element = document.createElement("figure");
    this.element.className = "finger-figure";
    this.element.append(drawing, this.caption);
    this.show(0, null);
  }

  // Shows the simulated angle, and the wanted one as a dashed line.
  show(deg: number, wanted: number | null): void {
    this.bones.setAttribute("points", points(deg));
    this.edge.setAttribute("points", points(deg));
    this.wanted.setAttribute("points", points(wanted ?? deg));
    const text = wanted === null ? "" : `, wanted ${wanted.toFixed(0)}°`;
    this.caption.textContent = `${this.name}: ${deg.toFixed(0)}°${text}`;
  }
}
