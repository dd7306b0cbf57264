// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon {

/// One number of a metric, with at most one label.
struct MetricValue {
  std::string label{};  ///< value of the metric's label; empty if the metric has no label
  double value = 0;
};

/// A metric. Its name ends with the unit, and with "_total" if the value only grows, as Prometheus
/// recommends.
struct Metric {
  enum class Kind { kGauge, kCounter };
  std::string name;
  std::string help;
  Kind kind = Kind::kGauge;
  std::string label_name{};  ///< empty if the metric has no label
  std::vector<MetricValue> values{};
};

/// Serves metrics to Prometheus at the path /metrics of a separate address, by HTTP without TLS.
class MetricsServer {
 public:
  /// Returns the present metrics. The server's threads call it for each request.
  using Read = std::function<std::vector<Metric>()>;

  /// `address` is HOST:PORT. Errors: FailedPrecondition (LISTEN_FAILED).
  static absl::StatusOr<std::unique_ptr<MetricsServer>> Start(const std::string& address,
                                                              Read read);
  virtual ~MetricsServer() = default;
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

 protected:
  MetricsServer() = default;
};

}  // namespace carillon
