// SPDX-License-Identifier: Apache-2.0
import type { Client } from '@connectrpc/connect';
import { AudioService } from './gen/carillon/v1/audio_service_pb';
import { ContactService } from './gen/carillon/v1/contact_service_pb';
import { DecompositionService } from './gen/carillon/v1/decomposition_service_pb';
import { ModalModelService } from './gen/carillon/v1/modal_model_service_pb';
import { SceneService } from './gen/carillon/v1/scene_service_pb';
import { clientOf } from './transport';
import type { Tunnel } from './tunnel';

/** The daemon's services over one tunnel. */
export interface Services {
  audio: Client<typeof AudioService>;
  contacts: Client<typeof ContactService>;
  jobs: Client<typeof DecompositionService>;
  models: Client<typeof ModalModelService>;
  scenes: Client<typeof SceneService>;
}

export function servicesOf(tunnel: Tunnel): Services {
  return {
    audio: clientOf(AudioService, tunnel), contacts: clientOf(ContactService, tunnel),
    jobs: clientOf(DecompositionService, tunnel), models: clientOf(ModalModelService, tunnel),
    scenes: clientOf(SceneService, tunnel),
  };
}
