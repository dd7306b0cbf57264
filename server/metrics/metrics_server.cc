// SPDX-License-Identifier: Apache-2.0
#include "server/metrics/metrics_server.h"

#include <prometheus/collectable.h>
#include <prometheus/exposer.h>
#include <prometheus/metric_family.h>

#include <exception>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

prometheus::MetricFamily FamilyOf(const Metric& metric) {
  const bool counts = metric.kind == Metric::Kind::kCounter;
  prometheus::MetricFamily family{
      .name = metric.name,
      .help = metric.help,
      .type = counts ? prometheus::MetricType::Counter : prometheus::MetricType::Gauge,
      .metric = {}};
  for (const MetricValue& each : metric.values) {
    prometheus::ClientMetric client;
    if (!metric.label_name.empty()) client.label = {{metric.label_name, each.label}};
    (counts ? client.counter.value : client.gauge.value) = each.value;
    family.metric.push_back(std::move(client));
  }
  return family;
}

class Readings final : public prometheus::Collectable {
 public:
  explicit Readings(MetricsServer::Read read) : read_(std::move(read)) {}

  std::vector<prometheus::MetricFamily> Collect() const override {
    std::vector<prometheus::MetricFamily> families;
    for (const Metric& metric : read_()) families.push_back(FamilyOf(metric));
    return families;
  }

 private:
  const MetricsServer::Read read_;
};

class ExposedMetrics final : public MetricsServer {
 public:
  ExposedMetrics(const std::string& address, Read read)
      : readings_(std::make_shared<Readings>(std::move(read))), exposer_(address) {
    exposer_.RegisterCollectable(readings_);
  }

 private:
  const std::shared_ptr<Readings> readings_;
  prometheus::Exposer exposer_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsServer>> MetricsServer::Start(const std::string& address,
                                                                    Read read) {
  try {
    return std::make_unique<ExposedMetrics>(address, std::move(read));
  } catch (const std::exception& error) {
    return Refusal(
        absl::StatusCode::kFailedPrecondition, "LISTEN_FAILED",
        absl::StrCat("cannot serve metrics on ", address, ": ", error.what(),
                     "; let --metrics name a free port at an IPv4 address of this machine, "
                     "such as 127.0.0.1:9464"));
  }
}

}  // namespace carillon
