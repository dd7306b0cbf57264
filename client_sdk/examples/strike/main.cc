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
  carillon::v1::AddObjectRequest bell;
  bell.set_scene(daemon->CreateScene({}).value());
  bell.set_modal_model(argv[1]);
  bell.mutable_material()->set_preset("bell_bronze");
  carillon::v1::ContactStreamStart start;
  start.set_scene(bell.scene());
  start.set_step_s(0.01);
  carillon::v1::ContactStep step;
  carillon::v1::Impulse& impulse = *step.add_impulses();
  impulse.set_object(daemon->AddObject(bell).value().handle());
  impulse.mutable_point_m()->set_z(0.1);
  impulse.mutable_impulse_newton_seconds()->set_z(-0.01);
  const auto contacts = daemon->StreamContacts(start).value();
  contacts->Send(step).IgnoreError();  // Finish() returns the error that ended the stream.
  std::cout << contacts->Finish().value().ShortDebugString() << '\n';
  std::this_thread::sleep_for(std::chrono::seconds(2));
  return daemon->DeleteScene(bell.scene()).ok() ? 0 : 1;
}
