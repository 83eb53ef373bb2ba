// What the map's file says: its report, and stretches that can be laid over the map.
const OVERLAYS = {
  weak: ['few features', 'UNCERTAIN', 7], one_way: ['driven one way only', 'INITIALIZING', 7],
  ambiguous: ['look like others far away', 'RECOVERING', 7], gaps: ['gaps', 'OFF_MAP', 3],
  doubtful: ['contradict themselves: check before use', 'OFF_MAP', 7],
};
const VERDICTS = {'kept': ['training', 3], 'multipath': ['UNCERTAIN', 5], 'no fix': ['INITIALIZING', 5],
  'out of order': ['RECOVERING', 5], 'spike': ['OFF_MAP', 6]};
const shownOverlays = new Set();

/** Training images of a stretch: image numbers of the map, or metres along the images of the session. */
function stretchImages(stretch) {
  const images = sessionImages[stretch.session];
  if (known(stretch.first)) {
    return images.filter((k) => k * map.stride >= stretch.first && k * map.stride <= stretch.last);
  }
  let way = 0;
  return images.filter((k, n) => {
    if (n) way += apart(trainingPosition(images[n - 1]), trainingPosition(k));
    return way >= stretch.from_m && way <= stretch.to_m;
  });
}

/** The more metres are expected, the wider. */
function drawErrors(context) {
  for (const stretch of map.findings.errors) {
    const width = Math.min(16, 2 + 8 * stretch.most_m);
    drawLine(context, stretchImages(stretch).map(trainingPosition), colour('first'), width);
  }
}

function drawFixes(context) {
  for (const session of map.build.sessions) {
    for (const path of session.paths_m) drawLine(context, path, colour('first'), 1.5);
    for (const [verdict, fixes] of Object.entries(session.fixes)) {
      drawDots(context, fixes.positions_m, colour(VERDICTS[verdict][0]), VERDICTS[verdict][1]);
    }
  }
}

function drawOverlays(context) {
  for (const name of ['errors', 'fixes', ...Object.keys(OVERLAYS)].filter((one) => shownOverlays.has(one))) {
    if (name === 'errors') drawErrors(context);
    else if (name === 'fixes') drawFixes(context);
    else {
      for (const stretch of map.findings[name]) {
        const points = stretchImages(stretch).map(trainingPosition);
        const [, style, width] = OVERLAYS[name];
        if (points.length > 1) drawLine(context, points, colour(style), width);
        else drawDots(context, points, colour(style), width + 3);
      }
    }
  }
}

function overlayChoice(name, words) {
  const choose = (event) => {
    if (event.target.checked) shownOverlays.add(name);
    else shownOverlays.delete(name);
    drawMap();
  };
  const box = make('input', {type: 'checkbox', id: 'show_' + name, onchange: choose});
  return make('label', {}, box, ' ' + words, make('br'));
}

function builtSession(session) {
  const counts = Object.entries(session.fixes).filter(([, fixes]) => fixes.count);
  return make('p', {}, `${session.name}: ${fixed(session.length_m, 0)} m; fixes: ` +
    counts.map(([verdict, fixes]) => `${fixes.count} ${verdict}`).join(', ') + '. ' + session.remarks.join(' '));
}

function startFacts() {
  const facts = byId('facts');
  layers.push(drawOverlays);
  if (map.build) {
    facts.append(make('h2', {}, 'Recordings'), ...map.build.sessions.map(builtSession),
      overlayChoice('fixes', 'fixes by what became of them, and paths'));
  }
  if (map.findings) {
    const choices = Object.entries(OVERLAYS).filter(([name]) => map.findings[name].length);
    facts.append(make('h2', {}, 'Show on the map'), overlayChoice('errors', 'expected error (wider is worse)'),
      ...choices.map(([name, [words]]) => overlayChoice(name, `${words} (${map.findings[name].length})`)));
  }
  if (map.report) facts.append(make('h2', {}, 'What the map holds'), make('pre', {id: 'report'}, map.report));
}
