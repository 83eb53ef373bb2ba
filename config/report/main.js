// Puts the parts together.
function shares() {
  return STATES.map((state) => [state, drive.state.filter((other) => other === state).length])
    .filter(([, images]) => images);
}

function startHeader() {
  const name = drive ? `${baseName(drive.bag)} in ${baseName(map.path)}` : baseName(map.path);
  document.title = name;
  byId('title').textContent = name;
  byId('summary').textContent = (drive ? `${count} images, ${fixed(drive.t[count - 1], 0)} s; ` : '') +
    `map: ${map.size} training images, sessions ${map.sessions.join(', ')}; visual_localization ${data.version}`;
  if (!drive) return;
  byId('legend').append(...shares().map(([state, images]) =>
    make('span', {}, stateWord(state), ` ${fixed(100 * images / count, 1)} %`)),
  make('span', {}, 'grey: training images; dashed: true path, and the map’s way while lost'));
}

startHeader();
startMoment();
startCut();
startFacts();
startMap();
startLines();
startWeak();
if (drive) moment.show(0);
else showTraining(0);
