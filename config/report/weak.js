// Weak stretches of the drive, worst first: wrong claims, claims that contradict their neighbours, losses.
const GAP_M = 10;  // a longer step between training images is a gap, as map_info counts them

/** Where the map ends within 15 m of a training image, along its session; null: it goes on. */
function endOfMap(k, step) {
  const images = sessionImages[map.session[k]];
  let at = images.indexOf(k);
  for (let way = 0; way < 15;) {
    const next = images[at + step];
    const length = next === undefined ? Infinity : apart(trainingPosition(images[at]), trainingPosition(next));
    if (length > GAP_M * Math.max(1, map.stride)) return trainingPosition(images[at]);
    way += length;
    at += step;
  }
  return null;
}

/** How far a moment lies from the straight line between the confirmed ones before and after it, metres. */
function offNeighbours(i, before, after) {
  if (before < 0 || after >= count || drive.t[after] - drive.t[before] > 15) return 0;
  const share = (drive.t[i] - drive.t[before]) / (drive.t[after] - drive.t[before] || 1);
  const [a, b, at] = [positionOf(before), positionOf(after), positionOf(i)];
  return apart(at, [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]);
}

function contradiction(i) {
  if (!isTracking(i)) return 0;
  let [before, after] = [i - 1, i + 1];
  while (before >= 0 && !isTracking(before)) --before;
  while (after < count && !isTracking(after)) ++after;
  const off = offNeighbours(i, before, after);
  const step = before >= 0 && after < count ? apart(positionOf(before), positionOf(after)) : 0;
  return off > Math.max(5, 3 * drive.sigma[i], step) ? off : 0;
}

/** What is wrong with a moment: [kind, how far in metres]; null: nothing. */
function flawOf(i) {
  const truth = truthOf(i);
  const error = truth ? apart(truth, positionOf(i)) : 0;
  if (isTracking(i) && error > Math.max(5, 3 * drive.sigma[i])) return ['wrong claim', error];
  const off = contradiction(i);
  if (off) return ['contradicts its neighbours', off];
  return isTracking(i) ? null : ['lost', 0];
}

/** Runs of moments with a flaw, joined over fewer than three without one. */
function weakStretches() {
  const stretches = [];
  for (let i = 0; i < count; ++i) {
    const flaw = flawOf(i);
    if (!flaw) continue;
    const last = stretches[stretches.length - 1];
    if (last && last.kind === flaw[0] && i - last.last <= 3) {
      last.last = i;
      last.off = Math.max(last.off, flaw[1]);
    } else stretches.push({kind: flaw[0], first: i, last: i, off: flaw[1]});
  }
  for (const stretch of stretches) {
    stretch.seconds = Math.abs(drive.t[Math.min(stretch.last + 1, count - 1)] - drive.t[stretch.first]);
  }
  const rank = (stretch) => ['lost', 'contradicts its neighbours', 'wrong claim'].indexOf(stretch.kind);
  return stretches.sort((a, b) => rank(b) - rank(a) || b.off - a.off || b.seconds - a.seconds);
}

function mostOften(values) {
  const counts = new Map();
  for (const value of values) counts.set(value, (counts.get(value) || 0) + 1);
  return [...counts].sort((a, b) => b[1] - a[1])[0][0];
}

/** Where the map ends at a loss: behind the last confirmed moment before it, or before the first one after it. */
function endAt(stretch) {
  for (const [near, beyond] of [[stretch.first - 1, stretch.first], [stretch.last + 1, stretch.last]]) {
    if (near < 0 || near >= count || !isTracking(near)) continue;
    const k = nearestTraining(positionOf(near));
    const driven = beyond > near ? drive.yaw[near] : drive.yaw[near] + Math.PI;
    for (const step of [1, -1]) {
      const end = endOfMap(k, step);
      const [east, north] = end ? [end[0] - drive.east[near], end[1] - drive.north[near]] : [0, 0];
      const passed = end && apart(end, trainingPosition(k)) === 0 && Math.hypot(east, north) > 3;
      if (end && (passed || east * Math.cos(driven) + north * Math.sin(driven) > -3)) return end;
    }
  }
  return null;
}

function beyondMap(stretch) {
  const truth = truthOf(Math.round((stretch.first + stretch.last) / 2));
  return truth ? apart(truth, trainingPosition(nearestTraining(truth))) : 0;
}

function wordsOf(stretch) {
  if (stretch.kind === 'wrong claim') return [`TRACKING up to ${fixed(stretch.off, 1)} m off the true path`];
  if (stretch.kind !== 'lost') return [`TRACKING up to ${fixed(stretch.off, 1)} m off the line between its neighbours`];
  const words = [];
  const moments = [...Array(stretch.last - stretch.first + 1).keys()].map((k) => stretch.first + k);
  if (drive.reason) words.push(drive.reason_words[mostOften(moments.map((i) => drive.reason[i]))]);
  const end = endAt(stretch);
  if (end) words.push(`the map ends at ${place(end)}`);
  const beyond = beyondMap(stretch);
  if (beyond > GAP_M) words.push(`${fixed(beyond, 0)} m from every training image`);
  if (!words.length) words.push(`mostly ${mostOften(moments.map((i) => drive.state[i]))}`);
  return words;
}

/** Commands that add a part of the drive to the map. */
function mending(stretch) {
  const ends = [drive.t[stretch.first], drive.t[stretch.last]];
  const from = (drive.start_s + Math.min(...ends) - 5).toFixed(1);
  const to = (drive.start_s + Math.max(...ends) + 5).toFixed(1);
  const part = `part_${stretch.first}_${stretch.last}.bag`;
  const condition = `topic == '/tf_static' or ${from} <= t.to_sec() <= ${to}`;
  return `rosbag filter ${quoted(drive.bag)} ${part} "${condition}"\n` +
    `rosrun visual_localization map_edit add --map ${quoted(map.path)} --bag ${part} ` +
    `--image-topic ${quoted(drive.image_topic)} --output extended.map`;
}

function weakRow(stretch) {
  const show = () => moment.show(stretch.first, true);
  const seconds = Math.ceil(stretch.seconds + 10);
  const onkeydown = (event) => { if (event.key === 'Enter') show(); };
  return make('tr', {class: 'choice', tabindex: '0', onclick: show, onkeydown},
    make('td', {}, stretch.kind),
    make('td', {}, `${fixed(drive.t[stretch.first], 1)} to ${fixed(drive.t[stretch.last], 1)} s`),
    make('td', {}, `${stretch.last - stretch.first + 1} images, ${fixed(stretch.seconds, 1)} s`),
    make('td', {}, wordsOf(stretch).join('; ')),
    make('td', {}, stretch.kind === 'lost' ? make('details', {}, make('summary', {},
      `add these ${seconds} s as a session`), make('pre', {}, mending(stretch)),
    'The recording needs positions (--fix-topic); without them drive there again with a receiver.') : ''));
}

function startWeak() {
  if (!drive) return;
  const stretches = weakStretches();
  const most = 50;
  byId('weak').append(make('h2', {}, 'Weak stretches, worst first'));
  if (!stretches.length) {
    byId('weak').append('None: every image is TRACKING, and no claim contradicts its neighbours.');
    return;
  }
  byId('weak').append(make('table', {},
    make('tr', {}, ...['what', 'when', 'how long', 'why', 'what mends it'].map((word) => make('th', {}, word))),
    ...stretches.slice(0, most).map(weakRow)));
  if (stretches.length > most) byId('weak').append(make('p', {}, `and ${stretches.length - most} less weak ones`));
}
