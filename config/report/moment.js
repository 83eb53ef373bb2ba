// One moment: the live image, the training image that it looks most like, and every figure.
const jpeg = (base64) => 'data:image/jpeg;base64,' + base64;

/** The image kept for this index or for the nearest one before it, within the spacing of those kept. */
function keptImage(images, index) {
  const kept = Math.floor(index / images.stride) * images.stride;
  return images.jpeg[kept] ? [kept, images.jpeg[kept]] : null;
}

/** Landmarks in the live image: circles agree with the pose, crosses do not. */
function drawnLandmarks(i) {
  const points = drive.landmarks[i];
  const size = drive.image_size;
  if (!points || !size) return [];
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', `0 0 ${size[0]} ${size[1]}`);
  for (const [x, y, inlier] of points) {
    const shape = svg.appendChild(document.createElementNS(svg.namespaceURI, 'path'));
    const r = size[0] / 80;
    shape.setAttribute('d', inlier ? `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`
      : `M${x - r} ${y - r}l${2 * r} ${2 * r}m0 ${-2 * r}l${-2 * r} ${2 * r}`);
    shape.setAttribute('stroke', colour(inlier ? 'TRACKING' : 'OFF_MAP'));
    shape.setAttribute('fill', 'none');
    shape.setAttribute('stroke-width', size[0] / 200);
  }
  return [svg];
}

function picture(kept, index, caption, marks = []) {
  if (!kept) return make('figure', {}, make('figcaption', {}, caption + ' (no picture in this page)'));
  const [of, base64] = kept;
  return make('figure', {}, make('img', {src: jpeg(base64), alt: caption}), ...(of === index ? marks : []),
    make('figcaption', {}, of === index ? caption : `${caption} (picture of number ${of})`));
}

function trainingPicture(image) {
  const k = trainingOf(image);
  const caption = `training image ${image} of ${map.sessions[map.session[k]]} at ${place(trainingPosition(k))}`;
  return picture(keptImage(map.previews, image), image, caption);
}

function list(pairs) {
  return make('dl', {}, ...pairs.flatMap(([name, value]) => [make('dt', {}, name), make('dd', {}, value)]));
}

function stateWord(state) {
  const key = make('span', {class: 'key'});
  key.style.background = colour(state);
  return make('span', {class: 'state'}, key, state);
}

/** Why the state is what it is, and what to do; the words of the program. */
function reasonOf(i) {
  if (!drive.reason) return [];
  const advice = drive.advice[drive.reason[i]];
  return [make('p', {id: 'reason'}, drive.sentence[i]), ...(advice ? [make('p', {id: 'advice'}, advice)] : [])];
}

function showMoment(i) {
  const truth = truthOf(i);
  const heading = ((90 - drive.yaw[i] * 180 / Math.PI) % 360 + 360) % 360;
  byId('moment').replaceChildren(
    make('h2', {}, `Image ${i}, ${fixed(drive.t[i], 1)} s`, moment.held ? ' (held)' : ''),
    make('p', {}, stateWord(drive.state[i]), ` by ${drive.source[i]}`),
    ...reasonOf(i),
    make('div', {class: 'pictures'},
      picture(keptImage(drive.images, i), i, `live image ${i}`, drawnLandmarks(i)), trainingPicture(drive.best[i])),
    list([
      ['position', `${place(positionOf(i))} m, sigma ${fixed(drive.sigma[i], 2)} m, heading ${fixed(heading, 0)}°`],
      ...(truth ? [['off the truth', fixed(apart(truth, positionOf(i)), 2, ' m')]] : []),
      ['probability', fixed(drive.probability[i], 3) +
        (drive.off_map ? `, off the map ${fixed(drive.off_map[i], 3)}` : '')],
      ...(rivalOf(i) ? [['rival', `${place(rivalOf(i))}, probability ${fixed(drive.rival[i], 3)}`]] : []),
      ...(drive.unconfirmed ? [['unconfirmed', `${drive.unconfirmed[i]} images`]] : []),
      ['support', `${drive.inliers[i]} inliers, ${drive.matches[i]} matches`],
      ['similarity', fixed(drive.similarity[i], 3)],
      ['features', `${drive.features[i]}`],
      ['grey level', `${fixed(drive.grey[i], 0)}, contrast ${fixed(drive.contrast[i], 0)}`],
      ['time', `${fixed(drive.latency[i], 0)} ms, ${drive.comparisons[i]} images compared`],
      ['stamp', (drive.start_s + drive.t[i]).toFixed(3)],
    ]));
}

function showTraining(k) {
  byId('moment').replaceChildren(make('h2', {}, `Training image ${k * map.stride}`),
    make('div', {class: 'pictures'}, trainingPicture(k * map.stride)));
}

function listenToKeys() {
  document.addEventListener('keydown', (event) => {
    if (event.target.closest('input, select, textarea')) return;
    const step = {ArrowRight: 1, ArrowLeft: -1, ArrowDown: 1, ArrowUp: -1}[event.key];
    if (event.key === 'Escape') { moment.release(); cut.stop(); }
    if (cut.drawing && event.key === 'Enter') cut.close();
    if (!step || !drive) return;
    event.preventDefault();
    moment.show(Math.min(count - 1, Math.max(0, moment.shown + step * (event.shiftKey ? 10 : 1))), true);
  });
}

function startMoment() {
  listenToKeys();
  if (!drive) return;
  moment.listeners.push(showMoment);
}
