// SPDX-License-Identifier: BSD-3-Clause
// Buttons, keys, and the link that carries time and camera.
import {worstOf} from './events.js';
import {canFilm, film, savePicture} from './export.js';
import {element} from './element.js';
import {kColorings} from './player.js';

const kViews = ['wireframe', 'ghost', 'isolate'];
const kShownFirst = ['contacts', 'witness', 'joints'];
const kSpeeds = [1e-3, 0.01, 0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10];

function actionsOf(player) {
  const {overlays, stage} = player;
  const toggle = (name) => {
    overlays.show[name] = !overlays.show[name];
    player.notify();
  };
  const chooseNext = (direction) => {
    const {bodies} = player.run;
    const k = player.chosen.body ? player.chosen.body.number + direction : direction > 0 ? 0 : -1;
    player.choose({body: bodies.at(k % bodies.length)});
  };
  return {
    play: {keys: [' ', 'k'], words: 'Play or pause', act: () => player.play()},
    stepBack: {keys: ['ArrowLeft', ','], words: 'One committed step back', act: () => player.step(-1)},
    stepOn: {keys: ['ArrowRight', '.'], words: 'One committed step on', act: () => player.step(1)},
    impactBack: {keys: ['ArrowUp', 'b'], words: 'Previous impact', act: () => player.impact(-1)},
    impactOn: {keys: ['ArrowDown', 'n'], words: 'Next impact', act: () => player.impact(1)},
    toBegin: {keys: ['Home'], words: 'To the start', act: () => player.seek(player.run.begin)},
    toEnd: {keys: ['End'], words: 'To the end', act: () => {
      player.seek(player.run.end);
      player.follows = player.isLive;
    }},
    toTime: {keys: ['a'], words: 'To a time that is typed', act: () => typeTime(player)},
    slower: {keys: ['-'], words: 'Slower', act: () => changeSpeed(player, -1)},
    faster: {keys: ['+', '='], words: 'Faster', act: () => changeSpeed(player, 1)},
    slow: {keys: ['s'], words: 'Slow motion around impacts', act: () => {
      player.slows = !player.slows;
      player.notify();
    }},
    worst: {keys: ['q'], words: 'To the largest impulse; again: nearest gap, longest solve', act: () => nextWorst(player)},
    loop: {keys: ['l'], words: 'Loop', act: () => {
      player.loops = !player.loops;
      player.notify();
    }},
    contacts: {keys: ['c'], words: 'Contacts, normals (green) and impulses (pink)', act: () => toggle('contacts')},
    witness: {keys: ['w'], words: 'Witness segment (blue) and pivot of the nearest pair', act: () => toggle('witness')},
    joints: {keys: ['j'], words: 'Joints (purple), springs (teal), axes of locked bodies', act: () => toggle('joints')},
    plane: {keys: ['v'], words: 'Plane between the nearest pair', act: () => toggle('plane')},
    trails: {keys: ['t'], words: 'Trails', act: () => toggle('trails')},
    wireframe: {keys: ['x'], words: 'Wireframe, of the chosen body or of all', act: () => player.setView('wireframe')},
    ghost: {keys: ['g'], words: 'Ghosts: what is not chosen is see-through', act: () => player.setView('ghost')},
    isolate: {keys: ['i'], words: 'Only the chosen body', act: () => player.setView('isolate')},
    color: {keys: ['o'], words: 'Colour by body, speed, sleep, island', act: () => {
      player.coloring = kColorings[(kColorings.indexOf(player.coloring) + 1) % kColorings.length];
      player.notify();
    }},
    next: {keys: [']'], words: 'Choose the next body', act: () => chooseNext(1)},
    previous: {keys: ['['], words: 'Choose the previous body', act: () => chooseNext(-1)},
    none: {keys: ['Escape'], words: 'Choose nothing', act: () => player.choose({})},
    frame: {keys: ['f'], words: 'Frame what moves', act: () => {
      stage.frame();
      player.notify();
    }},
    closeUp: {keys: ['z'], words: 'Close up: to the gap of the nearest pair', act: () => player.closeUp()},
    track: {keys: ['m'], words: 'The camera moves with the chosen body', act: () => {
      player.tracks = !player.tracks;
      player.notify();
    }},
    measure: {keys: ['u'], words: 'Measure between two points that are clicked', act: () => {
      player.measure.toggle();
      player.notify();
    }},
    picture: {keys: ['P'], words: 'Save the picture', act: () => savePicture(player)},
    ground: {keys: ['r'], words: 'Grid, scale and axes of the world', act: () => {
      stage.ground.isShown = !stage.ground.isShown;
      player.notify();
    }},
    legend: {keys: ['e'], words: 'What the marks mean', act: () => {
      player.hidesLegend = !player.hidesLegend;
      player.notify();
    }},
    panel: {keys: ['p'], words: 'Show or hide the panel', act: () => {
      const panel = document.getElementById('panel');
      panel.hidden = !panel.hidden;
      player.onResize();
      player.notify();
    }},
    theme: {keys: ['d'], words: 'Dark or light', act: () => player.setTheme(stage.theme === 'dark' ? 'light' : 'dark')},
    link: {keys: ['y'], words: 'Put time, camera and what is shown into the address, to be copied', act: () => writeLink(player)},
    help: {keys: ['?', 'h'], words: 'This list', act: () => document.getElementById('help').showModal()},
  };
}

// The clock becomes a field for a time; Enter goes there, Escape leaves it.
function typeTime(player) {
  const [clock, field] = ['time', 'at'].map((id) => document.getElementById(id));
  const close = () => {
    field.hidden = true;
    clock.hidden = false;
  };
  field.value = Number(player.t.toPrecision(9));
  field.setAttribute('aria-invalid', 'false');
  field.hidden = false;
  clock.hidden = true;
  field.select();
  field.focus();
  field.onblur = close;
  field.onkeydown = ({key}) => {
    if (key !== 'Enter' && key !== 'Escape') return;
    const text = field.value.trim().replace(',', '.');
    const t = text === '' ? NaN : Number(text);
    if (key === 'Enter' && Number.isNaN(t)) return void field.setAttribute('aria-invalid', 'true');
    if (key === 'Enter') {
      player.play(false);
      player.goTo(t);
    }
    player.stage.canvas.focus();  // closes the field
  };
}

// One after another of what was worst in the run.
function nextWorst(player) {
  const found = worstOf(player.run);
  if (found.length === 0) return;
  player.worst = ((player.worst ?? -1) + 1) % found.length;
  const {t, impact} = found[player.worst];
  if (impact) player.goToImpact(impact.number);
  else player.goTo(t);
}

function changeSpeed(player, direction) {
  const nearest = kSpeeds.reduce((best, speed) =>
    Math.abs(Math.log(speed / player.speed)) < Math.abs(Math.log(best / player.speed)) ? speed : best);
  const k = kSpeeds.indexOf(nearest) + direction;
  player.speed = kSpeeds[Math.min(Math.max(k, 0), kSpeeds.length - 1)];
  player.notify();
}

function writeLink(player) {
  const {camera, controls} = player.stage;
  const numbers = [...camera.position.toArray(), ...controls.target.toArray()];
  const camera_text = numbers.map((x) => Number(x.toPrecision(6))).join(',');
  const {chosen, view, coloring, overlays} = player;
  const more = new URLSearchParams();
  if (player.stage.camera.fov < 40) more.set('fov', String(Number(player.stage.camera.fov.toPrecision(6))));
  if (chosen.body) more.set('body', chosen.body.name);
  if (view) more.set('view', view);
  if (coloring !== 'body') more.set('color', coloring);
  const shown = Object.keys(overlays.show).filter((name) => overlays.show[name]).join(',');
  if (shown !== kShownFirst.join(',')) more.set('show', shown);
  const rest = more.size > 0 ? `&${more}` : '';
  history.replaceState(null, '', `#t=${player.t}&cam=${camera_text}${rest}`);
  navigator.clipboard?.writeText(location.href).catch(() => {});
}

function readChoice(player, link) {
  const {run, overlays} = player;
  const body = run.bodies.find(({name}) => name === link.get('body'));
  if (body) player.choose({body});
  if (kViews.includes(link.get('view')) && player.view !== link.get('view')) player.setView(link.get('view'));
  if (kColorings.includes(link.get('color'))) player.coloring = link.get('color');
  if (!link.has('show')) return;
  const shown = link.get('show').split(',');
  for (const name of Object.keys(overlays.show)) overlays.show[name] = shown.includes(name);
}

export function readLink(player) {
  const link = new URLSearchParams(location.hash.slice(1));
  const camera = link.get('cam')?.split(',').map(Number);
  if (camera?.length === 6 && camera.every(Number.isFinite)) {
    player.stage.camera.position.fromArray(camera, 0);
    player.stage.controls.target.fromArray(camera, 3);
    player.stage.isFramed = false;
    const fov = Number(link.get('fov') ?? 40);
    player.stage.camera.fov = fov > 0 && fov <= 40 ? fov : 40;
    player.stage.controls.update();
  }
  readChoice(player, link);
  const t = Number(link.get('t') ?? NaN);
  if (Number.isFinite(t)) player.seek(t);
  if (link.get('theme')) player.setTheme(link.get('theme') === 'dark' ? 'dark' : 'light');
  if (link.get('tab')) document.querySelector(`[data-tab="${CSS.escape(link.get('tab'))}"]`)?.click();
  document.body.classList.toggle('bare', link.get('bare') === '1');
}

function addButtons(player, actions) {
  const button = (name, text, isPressed) => {
    const {keys, words, act} = actions[name];
    const node = element('button', {title: `${words} (${keys[0] === ' ' ? 'space' : keys[0]})`,
                                    'aria-label': /\w\w/.test(text) ? `${text}: ${words}` : words, onclick: act}, text);
    if (isPressed) {
      player.changed.add(() => node.setAttribute('aria-pressed', String(Boolean(isPressed()))));
    }
    return node;
  };
  const play = button('play', '▶');
  player.changed.add(() => (play.textContent = player.isPlaying ? '❚❚' : '▶'));
  const speed = element('select', {'aria-label': 'Speed', title: 'Speed (+ and -)', onchange: () => {
    player.speed = Number(speed.value);
    player.notify();
  }}, ...kSpeeds.map((x) => element('option', {value: String(x)}, `${x}×`)));
  player.changed.add(() => {
    if (![...speed.options].some((option) => Number(option.value) === player.speed)) {
      speed.append(element('option', {value: String(player.speed)}, `${player.speed}×`));
    }
    speed.value = String(player.speed);
  });
  document.querySelector('#transport .buttons').append(
    button('impactBack', '⇤'), button('stepBack', '◂'), play, button('stepOn', '▸'),
    button('impactOn', '⇥'), speed, button('slow', 'Slow', () => player.slows),
    button('loop', '↻', () => player.loops));
  // The panel itself has a button that closes it.
  const panel = button('panel', 'Panel');
  panel.id = 'open-panel';
  player.changed.add(() => (panel.hidden = !document.getElementById('panel').hidden));
  document.getElementById('tools').append(
    button('contacts', 'Contacts', () => player.overlays.show.contacts),
    button('witness', 'Nearest', () => player.overlays.show.witness),
    button('plane', 'Plane', () => player.overlays.show.plane),
    ...(Object.keys(player.run.links).length > 0
      ? [button('joints', 'Joints', () => player.overlays.show.joints)] : []),
    button('trails', 'Trails', () => player.overlays.show.trails),
    button('wireframe', 'Wire', () => player.view === 'wireframe'),
    button('ghost', 'Ghost', () => player.view === 'ghost'),
    button('isolate', 'Isolate', () => player.view === 'isolate'),
    button('color', 'Colour'), button('frame', 'Frame'), button('closeUp', 'Close up'),
    button('track', 'Track', () => player.tracks), button('theme', '◐'),
    button('link', 'Link'), panel, button('help', '?'));
}

// What is set once in a while: a cut, measuring, and files.
function addViewTab(player, actions) {
  const {stage} = player;
  const axis = element('select', {'aria-label': 'Cut across'}, ...[['', 'no cut'], ['0', 'across x'], ['1', 'across y'], ['2', 'across z']]
    .map(([value, words]) => element('option', {value}, words)));
  const part = element('input', {type: 'range', min: '0', max: '1', step: '0.005', value: '0.5', 'aria-label': 'Place of the cut'});
  const cut = () => {
    stage.setCut(axis.value === '' ? undefined : Number(axis.value), Number(part.value));
    part.disabled = axis.value === '';
    player.notify();
  };
  axis.addEventListener('change', cut);
  part.addEventListener('input', cut);
  part.disabled = true;
  const measure = element('button', {onclick: actions.measure.act, title: `${actions.measure.words} (u)`}, 'Measure');
  player.changed.add(() => measure.setAttribute('aria-pressed', String(player.measure.isOn)));
  let stop;
  const filming = element('button', {id: 'film', hidden: !canFilm(), onclick: () => {
    if (stop) return stop();
    filming.textContent = 'Stop the film';
    stop = film(player, () => {
      stop = undefined;
      filming.textContent = 'Film from here';
    });
  }}, 'Film from here');
  document.getElementById('tab-view').append(
    element('h2', {}, 'Cut'), element('div', {class: 'filters'}, axis, part),
    element('h2', {}, 'Measure'),
    element('p', {class: 'dim'}, 'Click two points of bodies; each moves with its body.'), measure,
    element('h2', {}, 'Files'),
    element('div', {class: 'filters'}, element('button', {onclick: actions.picture.act}, 'Save picture'), filming),
    element('p', {class: 'dim'}, 'Numbers of charts: the button CSV at each of them. A film of every step, in any size: dyop export.'));
}

function addTabs(player) {
  const tabs = [...document.querySelectorAll('[role=tab]')];
  for (const tab of tabs) {
    tab.addEventListener('click', () => {
      for (const other of tabs) {
        other.setAttribute('aria-selected', String(other === tab));
        other.tabIndex = other === tab ? 0 : -1;
        document.getElementById(`tab-${other.dataset.tab}`).hidden = other !== tab;
      }
      player.notify();
    });
    tab.addEventListener('keydown', (event) => {
      const direction = {ArrowLeft: -1, ArrowRight: 1}[event.key];
      if (!direction) return;
      event.stopPropagation();
      const next = tabs[(tabs.indexOf(tab) + direction + tabs.length) % tabs.length];
      next.focus();
      next.click();
    });
  }
}

function addHelp(actions) {
  const dialog = document.getElementById('help');
  const name = (key) => ({' ': 'space', ArrowLeft: '←', ArrowRight: '→', ArrowUp: '↑', ArrowDown: '↓'}[key] ?? key);
  dialog.append(
    element('h2', {}, 'Keys'),
    element('table', {}, ...Object.values(actions).map(({keys, words}) =>
      element('tr', {}, element('th', {}, ...keys.flatMap((key) => [element('kbd', {}, name(key)), ' '])),
              element('td', {}, words)))),
    element('p', {class: 'dim'}, 'Drag turns the camera, right drag or two fingers move it, the wheel ' +
      'zooms. On the time axis the wheel zooms, a double click shows all. Pink lines are impacts, ' +
      'triangles are marks: what fell asleep or woke, stalled, or stayed undecided.'),
    element('details', {}, element('summary', {}, 'Licences of what this page contains'),
            element('pre', {id: 'licences'}, document.getElementById('notices').content.textContent)),
    element('form', {method: 'dialog'}, element('button', {}, 'Close')));
}

export function addControls(player) {
  const actions = actionsOf(player);
  addButtons(player, actions);
  addTabs(player);
  addViewTab(player, actions);
  addHelp(actions);
  document.getElementById('fold').addEventListener('click', actions.panel.act);
  document.getElementById('time').addEventListener('click', actions.toTime.act);
  const byKey = new Map(Object.values(actions).flatMap(({keys, act}) => keys.map((key) => [key, act])));
  window.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || document.getElementById('help').open) return;
    if (event.target.closest?.('select, input, textarea')) return;
    if (event.target.closest?.('button') && (event.key === ' ' || event.key === 'Enter')) return;
    const act = byKey.get(event.key);
    if (!act) return;
    event.preventDefault();
    act();
  });
  window.addEventListener('hashchange', () => readLink(player));
  let down;
  const canvas = player.stage.canvas;
  canvas.addEventListener('pointerdown', (event) => (down = [event.clientX, event.clientY]));
  canvas.addEventListener('pointerup', (event) => {
    if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
    const box = canvas.getBoundingClientRect();
    const hit = player.stage.pickPoint(event.clientX - box.left, event.clientY - box.top);
    if (player.measure.isOn) {
      player.measure.add(hit, player.t);
      return player.notify();
    }
    const body = hit?.body;
    player.choose(body ? {body} : {});
    if (body) document.querySelector('[data-tab=data]').click();
  });
}
