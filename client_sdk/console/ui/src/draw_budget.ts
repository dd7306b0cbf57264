// SPDX-License-Identifier: Apache-2.0
import type { Camera, Scene, WebGLRenderer } from 'three';

/** Draws at most half of the time: a picture by software would otherwise take the processor that the sound needs. */
export class DrawBudget {
  private restsUntilMs = 0;

  constructor(private readonly renderer: WebGLRenderer) {}

  mayDraw(nowMs: number): boolean {
    return nowMs >= this.restsUntilMs;
  }

  draw(scene: Scene, camera: Camera): void {
    const begin = performance.now();
    this.renderer.render(scene, camera);
    this.renderer.getContext().finish();
    const end = performance.now();
    this.restsUntilMs = end + (end - begin);
  }
}
