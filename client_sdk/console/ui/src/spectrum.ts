// SPDX-License-Identifier: Apache-2.0
import type { SoundingMode } from './modal_model';

const LOW_HZ = 20, HIGH_HZ = 20000, SPAN_DB = 80;
const MARGIN = { left: 44, right: 16, top: 8, bottom: 22 };

/** Draws the modes of a strike as bars over a logarithmic frequency, with their error bars to the left. */
export function drawSpectrum(canvas: HTMLCanvasElement, modes: SoundingMode[], kept: SoundingMode[], chosen?: number): void {
  const ratio = devicePixelRatio;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const pen = canvas.getContext('2d')!;
  pen.scale(ratio, ratio);
  pen.clearRect(0, 0, width, height);
  const x = (hz: number) => MARGIN.left + (width - MARGIN.left - MARGIN.right) * Math.log(hz / LOW_HZ) / Math.log(HIGH_HZ / LOW_HZ);
  const topDb = Math.ceil(Math.max(40, ...[...modes, ...kept].map((mode) => 20 * Math.log10(mode.levelPa / 2e-5 + 1e-9))) / 10) * 10;
  const bottom = height - MARGIN.bottom;
  const y = (db: number) => MARGIN.top + (bottom - MARGIN.top) * (topDb - db) / SPAN_DB;
  drawAxes(pen, getComputedStyle(canvas).color, x, y, topDb, width, bottom);
  pen.beginPath();
  pen.rect(MARGIN.left, MARGIN.top, width - MARGIN.left - MARGIN.right, bottom - MARGIN.top);
  pen.clip();
  pen.strokeStyle = '#c77700';
  for (const mode of kept) {
    line(pen, x(mode.frequencyHz), bottom, x(mode.frequencyHz), y(Math.max(topDb - SPAN_DB, 20 * Math.log10(mode.levelPa / 2e-5 + 1e-9))));
  }
  // The chosen one lies above the others, and many let each other be seen.
  for (const mode of [...modes.filter(({ index }) => index !== chosen), ...modes.filter(({ index }) => index === chosen)]) {
    pen.globalAlpha = modes.length > 200 && mode.index !== chosen ? 0.3 : 1;
    const db = Math.max(topDb - SPAN_DB, 20 * Math.log10(mode.levelPa / 2e-5 + 1e-9));
    pen.strokeStyle = mode.index === chosen ? '#d43d00' : '#3b7dd8';
    pen.lineWidth = mode.index === chosen ? 3 : 1.5;
    line(pen, x(mode.frequencyHz), bottom, x(mode.frequencyHz), y(db));
    pen.lineWidth = 1;
    line(pen, x(mode.frequencyHz * (1 - Math.min(mode.error, 0.3))), y(db), x(mode.frequencyHz), y(db));
  }
}

function drawAxes(pen: CanvasRenderingContext2D, ink: string, x: (hz: number) => number, y: (db: number) => number, topDb: number,
    width: number, bottom: number): void {
  pen.font = '11px system-ui';
  pen.fillStyle = ink;
  pen.strokeStyle = '#8884';
  pen.lineWidth = 1;
  pen.textAlign = 'center';
  for (const hz of [20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000]) {
    line(pen, x(hz), MARGIN.top, x(hz), bottom);
    pen.fillText(hz < 1000 ? `${hz}` : `${hz / 1000}k`, x(hz), bottom + 14);
  }
  pen.textAlign = 'right';
  for (let db = topDb; db >= topDb - SPAN_DB; db -= 20) {
    line(pen, MARGIN.left, y(db), width - MARGIN.right, y(db));
    pen.fillText(`${db} dB`, MARGIN.left - 4, y(db) + 4);
  }
}

function line(pen: CanvasRenderingContext2D, x0: number, y0: number, x1: number, y1: number): void {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}

/** The mode whose bar is nearest to a place of the canvas, within eight pixels. */
export function modeAt(canvas: HTMLCanvasElement, modes: SoundingMode[], place: number): SoundingMode | undefined {
  const inner = canvas.clientWidth - MARGIN.left - MARGIN.right;
  const at = (mode: SoundingMode) => MARGIN.left + inner * Math.log(mode.frequencyHz / LOW_HZ) / Math.log(HIGH_HZ / LOW_HZ);
  const nearest = modes.reduce<SoundingMode | undefined>((best, mode) =>
    (!best || Math.abs(at(mode) - place) < Math.abs(at(best) - place) ? mode : best), undefined);
  return nearest && Math.abs(at(nearest) - place) < 8 ? nearest : undefined;
}

/** A spectrogram that scrolls to the left, of what the page plays. */
export class Spectrogram {
  private readonly pen: CanvasRenderingContext2D;
  private ended = false;
  /** The time of each column, as playedS has it, the newest last. */
  private readonly times: (number | undefined)[] = [];
  private readonly levels: Uint8Array<ArrayBuffer>;

  constructor(private readonly canvas: HTMLCanvasElement, readonly analyser: AnalyserNode, private readonly playedS: () => number | undefined) {
    this.pen = canvas.getContext('2d', { willReadFrequently: true })!;
    this.levels = new Uint8Array(analyser.frequencyBinCount);
    this.canvas.width = 600;
    this.canvas.height = 120;
    const step = () => {
      if (this.ended) return;
      this.advance();
      // Half of the screen's frames are enough for columns of 85 ms, and leave the processor to the sound.
      requestAnimationFrame(() => requestAnimationFrame(step));
    };
    requestAnimationFrame(step);
  }

  end(): void {
    this.ended = true;
  }

  /** The time of the sound at a place of the canvas, as a share of its width. */
  timeAt(share: number): number | undefined {
    return this.times[Math.floor(share * this.canvas.width) - this.canvas.width + this.times.length];
  }

  private advance(): void {
    const { width, height } = this.canvas;
    this.times.push(this.playedS());
    if (this.times.length > width) this.times.shift();
    this.analyser.getByteFrequencyData(this.levels);
    this.pen.drawImage(this.canvas, -1, 0);
    const column = this.pen.createImageData(1, height);
    const highest = 16000 / this.analyser.context.sampleRate * 2 * this.levels.length;
    for (let row = 0; row < height; row += 1) {
      const level = this.levels[Math.floor((1 - row / height) * highest)]! / 255;
      column.data.set([255 * Math.min(1, 1.5 * level), 255 * level ** 2, 255 * (0.35 * level + 0.1), 255], 4 * row);
    }
    this.pen.putImageData(column, width - 1, 0);
  }
}
