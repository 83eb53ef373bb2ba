// The map on a canvas: metres of the map's frame, north up. What does not change lies below, what is pointed at above.
const view = {scale: 1, east: 0, north: 0, width: 0, height: 0};  // pixels a metre, metres of the middle
const toScreen = ([east, north]) =>
  [view.width / 2 + (east - view.east) * view.scale, view.height / 2 - (north - view.north) * view.scale];
const toMap = ([x, y]) =>
  [view.east + (x - view.width / 2) / view.scale, view.north - (y - view.height / 2) / view.scale];
const layers = [];  // what other parts draw: functions of a context
const base = byId('map_base');
const marks = byId('map_marks');

function shownPositions() {
  const east = map.east.concat(drive ? drive.east : []);
  const north = map.north.concat(drive ? drive.north : []);
  for (let i = 0; i < count; ++i) {
    if (!truthOf(i)) continue;
    east.push(drive.true_east[i]);
    north.push(drive.true_north[i]);
  }
  return [east, north];
}

function fitView() {
  const [east, north] = shownPositions();
  const range = (values) =>
    values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
  const [west, right] = range(east);
  const [south, top] = range(north);
  view.east = (west + right) / 2;
  view.north = (south + top) / 2;
  view.scale = 0.92 * Math.min(view.width / Math.max(5, right - west), view.height / Math.max(5, top - south));
}

/** A context of the canvas, cleared, in CSS pixels. */
function cleared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(view.width * ratio);
  canvas.height = Math.round(view.height * ratio);
  const context = canvas.getContext('2d');
  context.scale(ratio, ratio);
  return context;
}

function drawLine(context, points, style, width = 1.5, dash = []) {
  context.strokeStyle = style;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.beginPath();
  points.forEach((point, k) => context[k ? 'lineTo' : 'moveTo'](...toScreen(point)));
  context.stroke();
  context.setLineDash([]);
}

function drawDots(context, points, style, size) {
  context.fillStyle = style;
  for (const point of points) {
    const [x, y] = toScreen(point);
    context.fillRect(x - size / 2, y - size / 2, size, size);
  }
}

/** Each state has a shape of its own. */
function drawState(context, [x, y], state, size) {
  context.fillStyle = context.strokeStyle = colour(state);
  context.lineWidth = 1.5;
  context.beginPath();
  if (state === 'TRACKING') context.arc(x, y, size, 0, 7);
  else if (state === 'OFF_MAP') {
    context.moveTo(x - size, y - size);
    context.lineTo(x + size, y + size);
    context.moveTo(x - size, y + size);
    context.lineTo(x + size, y - size);
    context.stroke();
  } else if (state === 'UNCERTAIN') {
    context.moveTo(x, y - size * 1.3);
    context.lineTo(x + size * 1.2, y + size);
    context.lineTo(x - size * 1.2, y + size);
  } else context.rect(x - size, y - size, 2 * size, 2 * size);
  if (state !== 'OFF_MAP') context.fill();
}

/** Images of a session between two of them: the map's way while the position was lost. */
function wayBetween(from, to) {
  const session = map.session[from];
  if (session !== map.session[to]) return [];
  const images = sessionImages[session];
  const way = images.slice(images.indexOf(Math.min(from, to)), images.indexOf(Math.max(from, to)) + 1);
  return way.map(trainingPosition);
}

const lostWays = [];  // between a moment that is TRACKING and the next one beyond a loss
function findLostWays() {
  let last = -1;
  for (let i = 0; i < count; ++i) {
    if (!isTracking(i)) continue;
    if (last >= 0 && i > last + 1) {
      lostWays.push(wayBetween(nearestTraining(positionOf(last)), nearestTraining(positionOf(i))));
    }
    last = i;
  }
}

/** A track; no line over a jump, which may be a kidnapping. */
function drawTrack(context, at, style, width, dash) {
  let piece = [];
  for (let i = 0; i <= count; ++i) {
    const point = i < count ? at(i) : null;
    const jumps = point && piece.length && apart(point, piece[piece.length - 1]) > 30;
    if (!point || jumps) {
      if (piece.length > 1) drawLine(context, piece, style, width, dash);
      piece = [];
    }
    if (point) piece.push(point);
  }
}

function drawScale(context) {
  const metres = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000].find((m) => m * view.scale >= 60) || 10000;
  const x = view.width - 12 - metres * view.scale;
  context.fillStyle = colour('ink');
  context.fillRect(x, view.height - 14, metres * view.scale, 2);
  context.font = '12px system-ui, sans-serif';
  context.fillText(`${metres} m`, x, view.height - 18);
}

function drawBase() {
  const context = cleared(base);
  drawDots(context, map.landmarks, colour('landmark'), 1.5);
  for (const images of sessionImages) drawDots(context, images.map(trainingPosition), colour('training'), 4);
  for (const layer of layers) layer(context);
  for (const way of lostWays) drawLine(context, way, colour('RECOVERING'), 4, [2, 4]);
  if (drive) {
    drawTrack(context, truthOf, colour('truth'), 1.5, [6, 3]);
    drawTrack(context, (i) => isTracking(i) ? positionOf(i) : null, colour('TRACKING'), 1);
    for (let i = 0; i < count; ++i) drawState(context, toScreen(positionOf(i)), drive.state[i], count > 3000 ? 1.5 : 3);
  }
  drawScale(context);
}

function drawMarks() {
  const context = cleared(marks);
  const i = moment.shown;
  if (i >= 0) {
    const [x, y] = toScreen(positionOf(i));
    const best = trainingPosition(trainingOf(drive.best[i]));
    drawLine(context, [positionOf(i), best], colour('mark'), 2);
    drawDots(context, [best], colour('mark'), 8);
    if (truthOf(i)) drawLine(context, [positionOf(i), truthOf(i)], colour('truth'), 1.5);
    if (rivalOf(i)) drawDots(context, [rivalOf(i)], colour('second'), 10);
    context.strokeStyle = colour('mark');
    context.lineWidth = 2.5;
    context.beginPath();
    context.arc(x, y, 8, 0, 7);
    context.moveTo(x, y);
    context.lineTo(x + 20 * Math.cos(drive.yaw[i]), y - 20 * Math.sin(drive.yaw[i]));
    context.stroke();
    context.lineWidth = 1;
    context.beginPath();
    context.arc(x, y, Math.min(5000, drive.sigma[i] * view.scale), 0, 7);
    context.stroke();
  }
  drawCut(context);
}

function drawMap() {
  drawBase();
  drawMarks();
}

/** The moment that is drawn nearest to a pixel, and how far it is. */
function momentAt(pixel) {
  let best = -1;
  let least = 20;
  for (let i = 0; i < count; ++i) {
    const distance = apart(toScreen(positionOf(i)), pixel);
    if (distance < least) [best, least] = [i, distance];
  }
  return best;
}

function listenToMap() {
  const pixel = (event) => [event.offsetX, event.offsetY];
  let grabbed = null;
  marks.addEventListener('pointerdown', (event) => { grabbed = {at: pixel(event), moved: false}; });
  marks.addEventListener('pointermove', (event) => {
    const at = pixel(event);
    if (grabbed && event.buttons) {
      grabbed.moved ||= apart(at, grabbed.at) > 4;
      if (!grabbed.moved) return;
      view.east -= (at[0] - grabbed.at[0]) / view.scale;
      view.north += (at[1] - grabbed.at[1]) / view.scale;
      grabbed.at = at;
      drawMap();
    } else if (cut.drawing) cut.hover(toMap(at));
    else moment.point(momentAt(at));
  });
  marks.addEventListener('pointerup', (event) => {
    const clicked = grabbed && !grabbed.moved;
    grabbed = null;
    if (!clicked) return;
    if (cut.drawing) cut.add(toMap(pixel(event)));
    else if (drive) moment.show(momentAt(pixel(event)), true);
    else showTraining(nearestTraining(toMap(pixel(event))));
  });
  marks.addEventListener('wheel', (event) => {
    event.preventDefault();
    const before = toMap(pixel(event));
    view.scale = Math.min(500, Math.max(0.001, view.scale * Math.exp(-0.0015 * event.deltaY)));
    const after = toMap(pixel(event));
    view.east += before[0] - after[0];
    view.north += before[1] - after[1];
    drawMap();
  }, {passive: false});
}

function startMap() {
  const measure = () => { [view.width, view.height] = [base.clientWidth, base.clientHeight]; };
  measure();
  fitView();
  findLostWays();
  listenToMap();
  byId('tools').append(make('button', {onclick: () => { fitView(); drawMap(); }}, 'Whole map'));
  moment.listeners.push(drawMarks);
  window.addEventListener('resize', () => { measure(); drawMap(); });
  darkness.addEventListener('change', drawMap);
  drawMap();
}
