// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/channel.h>

#include <memory>
#include <string>

#include "carillon/client.h"
#include "carillon/v1/admin_service.grpc.pb.h"
#include "carillon/v1/audio_service.grpc.pb.h"
#include "carillon/v1/contact_service.grpc.pb.h"
#include "carillon/v1/decomposition_service.grpc.pb.h"
#include "carillon/v1/job_run_service.grpc.pb.h"
#include "carillon/v1/modal_model_service.grpc.pb.h"
#include "carillon/v1/scene_service.grpc.pb.h"

namespace carillon::client {

/// What a client holds: one stub for each service, all on one channel.
struct Client::Stubs {
  Stubs(std::string address, const std::shared_ptr<grpc::Channel>& channel)
      : server(std::move(address)),
        models(channel),
        decompositions(channel),
        scenes(channel),
        contacts(channel),
        audio(channel),
        admin(channel),
        job_runs(channel) {}

  std::string server;
  std::string admin_token;
  v1::ModalModelService::Stub models;
  v1::DecompositionService::Stub decompositions;
  v1::SceneService::Stub scenes;
  v1::ContactService::Stub contacts;
  v1::AudioService::Stub audio;
  v1::AdminService::Stub admin;
  v1::JobRunService::Stub job_runs;
};

}  // namespace carillon::client
