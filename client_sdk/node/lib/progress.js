// SPDX-License-Identifier: Apache-2.0
/** What a job does, or why it waits, in words. */
'use strict';

const { counted } = require('./checks');

/** Why a job waits, in the words of the command line. */
function waitText(wait) {
  const { cause, earlierJobCount: earlier, runningJobCount: count, runningJobLabel: label } = wait ?? {};
  if (earlier > 0) return `waiting: ${counted(earlier, 'job')} ${earlier === 1 ? 'is' : 'are'} before it`;
  const running = count === 1 ? label || 'a job' : counted(count, 'job');
  if (cause === 'WAIT_CAUSE_WORKER') return `waiting for ${count === 1 ? '' : 'one of '}${running}`;
  if (cause === 'WAIT_CAUSE_MEMORY') return `waiting for the memory of ${running}`;
  return cause === 'WAIT_CAUSE_COARSE_MODEL' ? 'waiting for its coarse model' : 'waiting';
}

/** The state of a job and, of one that waits, the reason. */
function stateOf(job) {
  const state = job.state.replace('JOB_STATE_', '').toLowerCase();
  return state === 'queued' ? `${state} (${waitText(job.wait)})` : state;
}

module.exports = { stateOf, waitText };
