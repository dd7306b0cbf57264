// SPDX-License-Identifier: Apache-2.0
//
// A simulation that goes on while its daemon is restarted: strikes a bar every 10 ms, and prints
// the number of steps that the daemon has taken in since it was last reached, and those dropped.
// Usage: lasting_stream SERVER MODEL; it ends with its standard input.

#include <carillon/lasting_stream.h>
#include <poll.h>
#include <unistd.h>

#include <iostream>
#include <string>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto client = carillon::client::Connect(argv[1]);
  carillon::client::SceneRegistration lathe;
  lathe.scene.set_id("lathe");
  carillon::v1::NewObject& bar = lathe.objects.emplace_back();
  bar.set_handle(5);
  bar.set_modal_model(argv[2]);
  carillon::v1::ContactStreamStart start;
  start.set_step_s(0.01);
  auto stream = carillon::client::OpenLastingStream(*client, lathe, start);
  if (!stream.ok()) {
    std::cout << stream.status() << std::endl;
    return 1;
  }
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  for (int step_number = 0; poll(&input, 1, 10) == 0; ++step_number) {
    carillon::v1::ContactStep step;
    step.set_time_s(0.01 * step_number);
    carillon::v1::Contact& strike = *step.add_contacts();
    strike.set_kind(carillon::v1::CONTACT_KIND_IMPACT);
    strike.set_object(5);
    strike.mutable_point_m();
    strike.mutable_impulse_newton_seconds()->set_z(0.001);
    if (const absl::Status sent = (*stream)->Send(step); !sent.ok()) {
      std::cout << sent << std::endl;
      return 1;
    }
    std::cout << (*stream)->Report().accepted_count() << " " << (*stream)->DroppedStepCount()
              << std::endl;
  }
  const auto last = (*stream)->Finish();
  std::cout << last.status() << std::endl;
  return last.ok() ? 0 : 1;
}
