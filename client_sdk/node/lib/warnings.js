// SPDX-License-Identifier: Apache-2.0
'use strict';

const { counted } = require('./checks');

const SCENE_FRAME = "the scene's frame";
/** Time by which a simulation in real time may run ahead. */
const USUAL_LEAD_S = 0.25;

function were(count, noun) {
  return `${counted(count, noun)} ${Number(count) === 1 ? 'was' : 'were'}`;
}

function warn(text, name = 'ContactWarning') {
  process.emitWarning(text, name);
}

/** Warns of the jobs with these labels, whose transfers a rendering would have used. */
function warnOfTransfers(labels) {
  warn(`${labels.join(', ')} ${labels.length === 1 ? 'is' : 'are'} still being computed, so that the sound is by the ` +
    "paper's coupling, and the same rendering will sound different later; await waitForTransfer() of the model first",
  'TransferWarning');
}

// The daemon cuts longer labels.
const MOST_LABEL_BYTES = 200;

/** Warns of a model that was stored before, with the label `label` instead of the one that the caller wanted, if any. */
function warnOfLabel(label, wanted) {
  if (!wanted || wanted === label || Buffer.byteLength(wanted) > MOST_LABEL_BYTES) return;
  warn(`the model of this body is known as '${label}' and keeps this label, so that '${wanted}' does not name it; ` +
    'an object that names no material now gets the material of this request, so name one where you add the object',
  'LabelWarning');
}

// The contract (Progress.extent_m) says above which extent the unit is likely to be wrong.
const LIKELY_EXTENT_M = 20;

/** Warns if the state of a job, newer than `before`, is the first to say that the body is suspiciously large. */
function warnOfUnit(job, before) {
  const extent = job.progress?.extent_m ?? 0;
  if (extent <= LIKELY_EXTENT_M || (before.progress?.extent_m ?? 0) > LIKELY_EXTENT_M) return;
  warn(`the body is ${Number(extent.toPrecision(3))} m across; if its coordinates are in another unit than metres, ` +
    "cancel and give the unit, such as unit: 'mm'", 'UnitWarning');
}

/**
 * Warns of contacts that are probably a mistake of the caller. `frame` is that of their points, and `acceptedCount` the
 * number of impulses that sounded.
 */
function warnOfContacts(findings, frame, acceptedCount = 0) {
  const gap = findings?.regular_gap_s ?? 0;
  if (gap) {
    warn(`most steps came ${Number(gap.toPrecision(3))} s apart, which is longer than the step that was stated, so that a ` +
      'body at rest strikes in each of them; state the step of the simulator and the times of steps in seconds');
  }
  const standing = Number(findings?.standing_step_count ?? 0);
  if (standing) {
    warn(`${standing} steps with contacts had the time of the step before; give each step the simulation's time, in ` +
      'seconds');
  }
  const changed = Number(findings?.changed_partner_count ?? 0);
  if (changed) {
    warn(`in ${changed} steps an object in contact touched none of its partners of the step before, so that a body at ` +
      "rest strikes in each of them; give a body the same partner in each step, such as the engine's number of that " +
      'body');
  }
  const fast = Number(findings?.fast_impulse_count ?? 0);
  if (fast) {
    const speed = Number(findings.largest_speed_change_m_per_s.toPrecision(3));
    warn(`${counted(fast, 'contact')} changed the speed of an object by up to ${speed} m/s; give impulses in newton ` +
      'seconds, which are forces times the step, and no forces');
  }
  const zeros = Number(findings?.zero_impulse_count ?? 0);
  // The daemon counts an engine's contact without an impulse as a load, and it counts a strike with an impulse of zero
  // as accepted, once or twice for one or two objects.
  if (zeros >= Math.max(1, Number(findings?.load_count ?? 0), acceptedCount / 2) && !Number(findings.blow_count ?? 0)) {
    warn(`the impulse of ${counted(zeros, 'contact')} was zero, and no other sounded; read impulses after the engine has ` +
      'solved its step, and give newton seconds');
  }
  const count = Number(findings?.distant_point_count ?? 0);
  if (!count) return;
  const distance = Number(findings.largest_distance_m.toPrecision(3));
  warn(`${counted(count, 'contact')} ${count === 1 ? 'lies' : 'lie'} up to ${distance} m away from the surfaces of the ` +
    `objects, and sound${count === 1 ? 's' : ''} at the nearest points; give points in metres, in ${frame}` +
    (frame === SCENE_FRAME ? ', and the pose of each object' : ''));
}

/** Warns of a stream that was open when its client was closed. */
function warnOfOpenStream(scene) {
  warn(`a stream of ${scene} was not closed before its client, so that its last contacts may not have sounded; await ` +
    'its close()');
}

/** Warns, once and at the end of a stream, of the contacts that did not sound as the caller meant. */
function warnOfStream(report, frame, droppedStepCount) {
  const told = [];
  if (report.late_count) {
    told.push(`${were(report.late_count, 'contact')} late, and sounded at once instead of at the right time: send each ` +
      'step when it happens, or open the stream with a longer delay, in seconds (it was ' +
      `${Number(report.scheduling_delay_s.toPrecision(3))})`);
  }
  if (report.remap_count) {
    told.push(`simulation time was mapped anew ${counted(report.remap_count, 'time')}, because every step of a quarter ` +
      'of a second was late: the simulator paused, or is slower than real time, for which carillon.Trace suits');
  }
  if (report.ahead_s > report.scheduling_delay_s + USUAL_LEAD_S) {
    told.push(`the newest step sounds only in ${Number(report.ahead_s.toPrecision(3))} s, because the simulation ran ` +
      'faster than real time: send each step when it happens, keep the scene until then, or render a carillon.Trace');
  }
  if (report.dropped_count) {
    told.push(`${were(report.dropped_count, 'contact')} lost, because too many waited for the mixer`);
  }
  if (droppedStepCount) {
    told.push(`${were(droppedStepCount, 'step')} not sent, because over 4096 waited for the network: await ` +
      'stream.step(...), because a loop that never awaits anything sends nothing before it ends');
  }
  if (report.rejected_count) {
    const { reason, message } = report.last_rejection;
    told.push(`${were(report.rejected_count, 'contact')} rejected, the last one with ${reason}: ` +
      message.replaceAll("the object's frame", frame));
  }
  if (told.length) warn(told.join('; '));
  warnOfContacts(report.findings, frame, Number(report.accepted_count ?? 0) + Number(report.late_count ?? 0));
}

module.exports = { SCENE_FRAME, warnOfContacts, warnOfLabel, warnOfOpenStream, warnOfStream, warnOfTransfers, warnOfUnit };
