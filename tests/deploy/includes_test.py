# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_includes


class Includes(TreeTest):
    def setUp(self):
        super().setUp()
        self.copy("deploy/lint/rooms.toml")

    def check_file(self, name, *headers):
        self.write(name, "".join(f"#include {header}\n" for header in headers))
        return check_includes.check(self.root)

    def test_what_the_table_allows_passes(self):
        self.assert_found(self.check_file(
            "server/synthesis/mixer.cc", "<span>", '"server/base/clock.h"',
            '"server/synthesis/limiter.h"', '"absl/status/status.h"'))

    def test_another_room_is_refused_with_file_and_line(self):
        self.assert_found(
            self.check_file("server/synthesis/mixer.cc", "<span>", '"server/api/scene_api.h"'),
            "server/synthesis/mixer.cc:2: server/synthesis may not include server/api/scene_api.h")

    def test_clients_and_precompute_never_include_the_server(self):
        self.write("client_sdk/cpp/client.cc", '#include "server/base/clock.h"\n')
        self.write("precompute/codec.cc", '#include "server/mode_database/codec/modal_model.h"\n')
        self.assert_found(check_includes.check(self.root), "precompute/codec.cc:1",
                          "client_sdk/cpp/client.cc:1")

    def test_a_header_of_an_include_root_belongs_to_the_room_that_holds_it(self):
        self.write("client_sdk/cpp/include/carillon/client.h", '#include <grpcpp/channel.h>\n')
        self.write("client_sdk/cli/main.cc", '#include "carillon/client.h"\n')
        self.write("server/daemon/main.cc", '#include "carillon/client.h"\n')
        self.assert_found(
            check_includes.check(self.root),
            "server/daemon/main.cc:1: server/daemon may not include client_sdk/cpp/include/carillon/client.h",
            "grpc (grpcpp/channel.h) may appear in")

    def test_the_inside_of_the_sdk_is_refused_to_its_users(self):
        self.assert_found(
            self.check_file("client_sdk/cli/main.cc", '"client_sdk/cpp/internal/stubs.h"'),
            "client_sdk/cli may not include client_sdk/cpp/internal/stubs.h")

    def test_grpc_in_precompute_is_refused_generated_or_not(self):
        self.assert_found(
            self.check_file("precompute/pipeline/decompose.cc", "<grpcpp/grpcpp.h>",
                            '"carillon/v1/audio_service.grpc.pb.h"'),
            "grpc (grpcpp/grpcpp.h) may appear in",
            "grpc (carillon/v1/audio_service.grpc.pb.h) may appear in")

    def test_a_library_outside_its_file_is_refused(self):
        self.assert_found(self.check_file("server/base/digest.h", "<Eigen/Core>"),
                          "eigen (Eigen/Core) may appear in precompute/")

    def test_an_unknown_library_is_refused(self):
        self.assert_found(self.check_file("server/base/digest.h", "<boost/any.hpp>"),
                          "boost/any.hpp belongs to no library")

    def test_a_wrong_dependency_in_cmake_is_refused(self):
        self.write("server/api/CMakeLists.txt", "carillon_room(server_api SOURCES a.cc)\n")
        self.write("server/base/CMakeLists.txt",
                   "carillon_room(server_base SOURCES b.cc DEPENDS server_api error_reason)\n")
        self.assert_found(check_includes.check(self.root),
                          "server_base (server/base) may not depend on server_api")


if __name__ == "__main__":
    unittest.main()
