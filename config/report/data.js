// The data of the page and what every part needs: columns, colours, words.
// Texts come from bags and maps: they become text nodes, never markup.
const data = JSON.parse(document.getElementById('data').textContent);
const map = data.map;
const drive = data.drive;  // undefined on the page of a map
const STATES = ['TRACKING', 'UNCERTAIN', 'RECOVERING', 'OFF_MAP', 'INITIALIZING'];

const byId = (id) => document.getElementById(id);
const darkness = window.matchMedia('(prefers-color-scheme: dark)');
let colours = {};
darkness.addEventListener('change', () => { colours = {}; });
const colour = (name) =>
  colours[name] ||= getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
const known = (value) => value !== null && value !== undefined;
const fixed = (value, digits, unit = '') => known(value) ? value.toFixed(digits) + unit : '–';
const place = (point) => `(${fixed(point[0], 1)}, ${fixed(point[1], 1)})`;
const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
const baseName = (path) => path.split('/').pop();

/** An element with attributes and children, which are elements or texts. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** A word of a shell's command line. */
const quoted = (text) =>
  /^[\w.,/=+:][\w.,/=+:-]*$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;

const count = drive ? drive.t.length : 0;
const positionOf = (i) => [drive.east[i], drive.north[i]];
const truthOf = (i) => known(drive.true_east[i]) ? [drive.true_east[i], drive.true_north[i]] : null;
const isTracking = (i) => drive.state[i] === 'TRACKING';

// Training images: of a large map every map.stride-th is in the page.
const trainingOf = (image) => Math.min(map.east.length - 1, Math.floor(image / map.stride));
const trainingPosition = (k) => [map.east[k], map.north[k]];

/** The training image in the page that is nearest to a position. */
function nearestTraining(point) {
  let best = 0;
  let least = Infinity;
  for (let k = 0; k < map.east.length; ++k) {
    const distance = Math.hypot(map.east[k] - point[0], map.north[k] - point[1]);
    if (distance < least) [best, least] = [k, distance];
  }
  return best;
}

/** The training images of one session in the order of the map. */
const sessionImages = map.sessions.map((_, session) => [...map.east.keys()].filter((k) => map.session[k] === session));

/** Which moment is shown; listeners hear of it. */
const moment = {
  shown: -1, held: false, listeners: [],
  show(i, hold = this.held) {
    if (i < 0 || i >= count) return;
    this.held = hold;
    this.shown = i;
    for (const listener of this.listeners) listener(i);
  },
  point(i) { if (!this.held && i !== this.shown) this.show(i); },
  release() { this.held = false; },
};

/** The best other place, where one is known. */
const rivalOf = (i) =>
  drive.rival_east && known(drive.rival_east[i]) ? [drive.rival_east[i], drive.rival_north[i]] : null;
