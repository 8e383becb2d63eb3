// Elements of the page.

export type Child = Node | string | null;

// Creates an element with attributes and children. A function as an attribute is an event listener.
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, string | boolean | ((event: Event) => void)> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") {
      element.addEventListener(name, value);
    } else if (value === true) {
      element.setAttribute(name, "");
    } else if (value !== false) {
      element.setAttribute(name, value);
    }
  }
  element.append(...children.filter((child) => child !== null));
  return element;
}

let count = 0;

// A slider with its label and its value, whose unit belongs to the text of `format`.
export function slider(options: {
  label: string;
  min: number;
  max: number;
  step: number;
  value: number;
  format: (value: number) => string;
  change: (value: number) => void;
}): { element: HTMLElement; input: HTMLInputElement; set: (value: number) => void } {
  const id = `slider-${++count}`;
  const input = make("input", {
    type: "range",
    id,
    min: String(options.min),
    max: String(options.max),
    step: String(options.step),
    value: String(options.value),
  });
  const output = make("output", { for: id });
  const show = (): void => {
    const text = options.format(Number(input.value));
    output.textContent = text;
    input.setAttribute("aria-valuetext", text);
  };
  input.addEventListener("input", () => {
    show();
    options.change(Number(input.value));
  });
  show();
  const element = make("div", { class: "control" }, make("label", { for: id }, options.label), output, input);
  return {
    element,
    input,
    set: (value) => {
      input.value = String(value);
      show();
    },
  };
}

// A choice with its label.
export function choice(options: {
  label: string;
  values: [string, string][];
  value: string;
  change: (value: string) => void;
}): { element: HTMLElement; select: HTMLSelectElement } {
  const id = `choice-${++count}`;
  const select = make("select", { id });
  for (const [value, text] of options.values) {
    select.append(make("option", { value, selected: value === options.value }, text));
  }
  select.addEventListener("change", () => options.change(select.value));
  return { element: make("div", { class: "row" }, make("label", { for: id }, options.label), select), select };
}
