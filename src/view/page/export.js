// SPDX-License-Identifier: BSD-3-Clause
// Files that the page itself makes: the picture, the numbers of a chart, a film.

const kFramesPerSecond = 30;
const kBitsPerSecond = 8e6;

function save(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const fileName = (title, ending) => `${title.replace(/[^\p{L}\p{N}]+/gu, '-').replace(/^-|-$/g, '').slice(0, 60) || 'dyop'}.${ending}`;

// Rows of comma-separated numbers with all their digits; names are quoted.
export function csvOf(names, columns) {
  const quoted = (name) => `"${String(name).replaceAll('"', '""')}"`;
  const rows = columns[0].map((_, k) => columns.map((column) => (column[k] == null ? '' : String(column[k]))).join(','));
  return `${[names.map(quoted).join(','), ...rows].join('\n')}\n`;
}

export function saveChart(title, names, columns) {
  save(new Blob([csvOf(names, columns)], {type: 'text/csv'}), fileName(title, 'csv'));
}

// The picture with the title and the time.
export function pictureOf(player) {
  player.draw(performance.now(), true);
  const {canvas} = player.stage;
  const copy = document.createElement('canvas');
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const pen = copy.getContext('2d');
  pen.drawImage(canvas, 0, 0);
  const size = Math.round(canvas.height / 45);
  pen.font = `600 ${size}px system-ui, sans-serif`;
  pen.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--text');
  pen.fillText(`${player.run.title}   ${player.stamp.textContent}`, size, 1.6 * size);
  return copy;
}

export function savePicture(player) {
  pictureOf(player).toBlob((blob) => save(blob, fileName(player.run.title, 'png')), 'image/png');
}

export const canFilm = () => typeof MediaRecorder === 'function' && 'captureStream' in HTMLCanvasElement.prototype;

// Plays the run from here on, at the speed that is set, until its end or until asked again.
export function film(player, whenDone) {
  const recorder = new MediaRecorder(player.stage.canvas.captureStream(kFramesPerSecond), {videoBitsPerSecond: kBitsPerSecond});
  const parts = [];
  recorder.addEventListener('dataavailable', (event) => parts.push(event.data));
  recorder.addEventListener('stop', () => {
    save(new Blob(parts, {type: recorder.mimeType}), fileName(player.run.title, /mp4/.test(recorder.mimeType) ? 'mp4' : 'webm'));
    whenDone();
  });
  const end = () => {
    if (player.isPlaying || recorder.state === 'inactive') return;
    player.changed.delete(end);
    recorder.stop();
  };
  player.loops = false;
  recorder.start();
  player.play(true);
  player.changed.add(end);
  return () => player.play(false);
}
