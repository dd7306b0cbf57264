// SPDX-License-Identifier: Apache-2.0
'use strict';

/** Warns of the jobs with these labels, whose transfers the objects lack, and says how these sound meanwhile. */
function warnOfTransfers(labels, meanwhile) {
  process.emitWarning(`${labels.join(', ')} ${labels.length === 1 ? 'is' : 'are'} still being computed, so that ` +
    `${meanwhile}; await waitForTransfer() of the model first`, 'TransferWarning');
}

// The daemon cuts longer labels.
const MOST_LABEL_BYTES = 200;

/** Warns of a model that was stored before, with the label `label` instead of the one that the caller wanted, if any. */
function warnOfLabel(label, wanted) {
  if (!wanted || wanted === label || Buffer.byteLength(wanted) > MOST_LABEL_BYTES) return;
  process.emitWarning(`the model of this body is known as '${label}' and keeps this label, so that '${wanted}' does not name it; ` +
    'an object that names no material now gets the material of this request, so name one where you add the object',
  'LabelWarning');
}

/** Warns of a scene with panning or two ears whose daemon plays one channel. */
function warnOfOneChannel(scene) {
  process.emitWarning(`${scene} has panning or two ears, but the daemon plays one channel, which has neither; start it by ` +
    '`carillond --channels 2`', 'HearingWarning');
}

/** Passes on what the daemon says about contacts that are probably a mistake of the caller. */
function warnOfContacts(warnings) {
  for (const { id, text } of warnings) process.emitWarning(`${id}: ${text}`, { type: 'ContactWarning', code: id });
}

/** Warns of a stream that was open when its client was closed. */
function warnOfOpenStream(scene) {
  warnOfContacts([{ id: 'STREAM_NOT_CLOSED', text: `a stream of ${scene} was not closed before its client, so that its ` +
    'last contacts may not have sounded; await its close()' }]);
}

module.exports = { warnOfContacts, warnOfLabel, warnOfOneChannel, warnOfOpenStream, warnOfTransfers };
