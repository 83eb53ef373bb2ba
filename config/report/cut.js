// A polygon drawn on the map becomes the file and the command of map_edit cut.
const cut = {
  drawing: false, corners: [], pointer: null,
  start() { Object.assign(this, {drawing: true, corners: [], pointer: null}); this.changed(); },
  stop() { this.drawing = false; this.pointer = null; this.changed(); },
  hover(point) { this.pointer = point; drawMarks(); },
  add(point) {
    const first = this.corners[0];
    if (this.corners.length > 2 && apart(toScreen(first), toScreen(point)) < 10) this.close();
    else { this.corners.push(point); this.changed(); }
  },
  close() { if (this.corners.length > 2) this.stop(); },
  changed() {
    byId('cut_draw').setAttribute('aria-pressed', this.drawing);
    showCut();
    drawMarks();
  },
};

function drawCut(context) {
  if (!cut.corners.length) return;
  const end = cut.drawing ? cut.pointer : cut.corners[0];
  const ring = cut.corners.concat(end ? [end] : []);
  drawLine(context, ring, colour('mark'), 2, cut.drawing ? [6, 4] : []);
  drawDots(context, cut.corners, colour('mark'), 7);
}

function isInside([x, y], ring) {
  let inside = false;
  ring.forEach(([ax, ay], k) => {
    const [bx, by] = ring[(k + 1) % ring.length];
    if ((ay > y) !== (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)) inside = !inside;
  });
  return inside;
}

/** GeoJSON in metres of the map's frame: the polygon, or all around with it as a hole. */
function cutFile(keepInside) {
  const closed = (ring) => ring.concat([ring[0]]).map((point) => point.map((metres) => Number(metres.toFixed(2))));
  const far = 1e6;
  const outer = [[-far, -far], [far, -far], [far, far], [-far, far]];
  const rings = keepInside ? [closed(cut.corners)] : [closed(outer), closed(cut.corners)];
  return JSON.stringify({type: 'Polygon', coordinates: rings});
}

function showCut() {
  byId('cut').hidden = cut.drawing ? false : cut.corners.length < 3;
  const done = !cut.drawing && cut.corners.length > 2;
  byId('cut_help').textContent =
    cut.drawing ? 'Click the corners; the first one again, or Enter, closes; Escape ends.' : '';
  byId('cut_result').hidden = !done;
  if (!done) return;
  const keepInside = byId('cut_keep').value === 'inside';
  const training = [...map.east.keys()].map(trainingPosition);
  const kept = training.filter((point) => isInside(point, cut.corners) === keepInside).length;
  byId('cut_count').textContent = `keeps ${Math.round(100 * kept / training.length)} % of the training images`;
  byId('cut_command').textContent =
    `rosrun visual_localization map_edit cut --map ${quoted(map.path)} --polygon cut.geojson --metres --output cut.map`;
  byId('cut_file').textContent = cutFile(keepInside);
  byId('cut_save').href = 'data:application/geo+json,' + encodeURIComponent(cutFile(keepInside));
}

function startCut() {
  const start = () => cut.start();
  byId('tools').append(make('button', {id: 'cut_draw', 'aria-pressed': 'false', onclick: start}, 'Cut the map'));
  byId('cut').append(make('h2', {}, 'Cut the map'), make('p', {id: 'cut_help'}),
    make('div', {id: 'cut_result'},
      make('select', {id: 'cut_keep', 'aria-label': 'What stays', onchange: showCut},
        make('option', {value: 'inside'}, 'keep what is inside'),
        make('option', {value: 'outside'}, 'keep what is outside')),
      ' ', make('span', {id: 'cut_count'}), ' ',
      make('a', {id: 'cut_save', download: 'cut.geojson'}, 'Save cut.geojson'),
      make('pre', {id: 'cut_file'}), make('pre', {id: 'cut_command'})));
}
