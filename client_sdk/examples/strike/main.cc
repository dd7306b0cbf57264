// SPDX-License-Identifier: Apache-2.0
//
// strike modalModels/DIGEST: strikes a stored model of the daemon at $CARILLON_SERVER once, and
// lets it ring for two seconds.
#include <carillon/client.h>

#include <chrono>
#include <iostream>
#include <thread>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto daemon = carillon::client::Connect();
  carillon::v1::AddObjectsRequest request;
  request.set_scene(daemon->CreateScene().value().name());
  carillon::v1::NewObject& bell = *request.add_objects();
  bell.set_modal_model(argv[1]);
  bell.mutable_material()->set_preset("bell_bronze");
  carillon::v1::ContactStreamStart start;
  start.set_scene(request.scene());
  start.set_step_s(0.01);
  carillon::v1::ContactStep step;
  carillon::v1::Contact& impact = *step.add_contacts();
  impact.set_kind(carillon::v1::CONTACT_KIND_IMPACT);
  impact.set_object(daemon->AddObjects(request).value().front().handle());
  impact.mutable_point_m()->set_z(0.1);
  impact.mutable_impulse_newton_seconds()->set_z(-0.01);
  const auto contacts = daemon->StreamContacts(start).value();
  contacts->Send(step).IgnoreError();  // Finish() returns the error that ended the stream.
  std::cout << contacts->Finish().value().ShortDebugString() << '\n';
  std::this_thread::sleep_for(std::chrono::seconds(2));
  return daemon->DeleteScene(request.scene()).ok() ? 0 : 1;
}
