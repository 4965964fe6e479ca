// Elements and colours of the page.

/**
 * element('button', {class: 'x', onclick: f}, child, …): false and null leave an attribute out, true
 * gives an empty one.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, string | number | boolean | null | ((event: Event) => void)>} attributes
 * @param {(Node | string)[]} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') node.addEventListener(name.slice(2), value);
    else if (value !== null && value !== false) node.setAttribute(name, value === true ? '' : String(value));
  }
  node.append(...children);
  return node;
}

/**
 * The element of this id, which must exist.
 * @param {string} id
 */
export function byId(id) {
  const node = document.getElementById(id);
  if (!node) throw new Error(`the page has no element "${id}"`);
  return node;
}

const kLight = ['#1667ad', '#c8471d', '#127a50', '#9a3d78', '#806200', '#0b7f97', '#5f49b8', '#7d4526'];
const kDark = ['#6cb6ff', '#ff9166', '#55cf9a', '#f08cc3', '#e3c04d', '#5fd3ea', '#b9a5ff', '#d9a07c'];

export function isDark() {
  const chosen = document.documentElement.dataset.theme;
  if (chosen === 'light' || chosen === 'dark') return chosen === 'dark';
  return matchMedia('(prefers-color-scheme: dark)').matches;
}

/** @param {number} index */
export function driveColor(index) {
  const colors = isDark() ? kDark : kLight;
  return colors[index % colors.length];
}
