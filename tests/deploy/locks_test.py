# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_locks


class Locks(TreeTest):
    def test_the_annotated_mutex_and_the_file_that_wraps_the_standards_pass(self):
        self.write("server/base/mutex.h", "std::mutex mutex_;\n")
        self.write("server/base/recursive_mutex.h", "std::recursive_mutex mutex_;\n")
        self.write("server/a.cc", "Mutex mutex_;  // not std::mutex\nMutexLock lock(&mutex_);\n")
        self.assert_found(check_locks.check(self.root))

    def test_every_kind_of_raw_lock_is_found(self):
        self.write("server/scene/a.h", "std::mutex a;\nstd::recursive_mutex b;\nstd::shared_mutex c;\n")
        self.write("server/scene/a.cc", "const std::lock_guard lock(a);\nstd::condition_variable d;\n")
        self.write("server/scene/b.cc", "absl::MutexLock lock(&a);\npthread_mutex_lock(&a);\n")
        self.write("client_sdk/cpp/a.cc", "std::mutex a;\n")
        self.assert_found(check_locks.check(self.root), "server/scene/a.cc:1", "server/scene/a.cc:2",
                          "server/scene/a.h:1", "server/scene/a.h:2", "server/scene/a.h:3", "server/scene/b.cc:1",
                          "server/scene/b.cc:2", "client_sdk/cpp/a.cc:1")

    def test_the_client_may_use_abseils(self):
        self.write("client_sdk/cpp/a.cc", "absl::Mutex a;\n")
        self.assert_found(check_locks.check(self.root))

    def test_the_worker_has_a_wrapper_of_its_own(self):
        self.write("precompute/sparse/mutex.h", "std::mutex mutex_;\n")
        self.write("precompute/sparse/a.cc", "Mutex a;\nstd::mutex b;\n")
        self.assert_found(check_locks.check(self.root), "precompute/sparse/a.cc:2")

    def test_tests_may_use_the_standards(self):
        self.write("tests/server/a.cc", "std::mutex a;\n")
        self.assert_found(check_locks.check(self.root))


if __name__ == "__main__":
    unittest.main()
