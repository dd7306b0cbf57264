// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/daemon/options.h"

namespace carillon {

/// Calls visit(key, setting) for each setting of the configuration file.
template <typename SomeOptions, typename Visit>
void VisitSettings(SomeOptions& options, const Visit& visit) {
  visit("listen", options.addresses);
  visit("data_dir", options.data_directory);
  visit("access_file", options.access_file);
  visit("tls_certificate", options.tls_certificate_file);
  visit("tls_key", options.tls_key_file);
  visit("tls_client_roots", options.tls_client_roots_file);
  visit("audio_device", options.audio_device);
  visit("audio_program", options.audio_program);
  visit("sample_rate", options.sample_rate_hz);
  visit("channels", options.channel_count);
  visit("gain", options.gain);
  visit("full_scale_pa", options.full_scale_pa);
  visit("head", options.head_file);
  visit("block_frames", options.block_frame_count);
  visit("look_ahead_blocks", options.look_ahead_block_count);
  visit("scene_grace", options.scene_grace_s);
  visit("client_share", options.client_share);
  visit("metrics", options.metrics_address);
  visit("log_level", options.log_level);
  visit("workers", options.worker_count);
  visit("memory_budget_mib", options.memory_budget_mib);
  visit("job_memory_mib", options.job_memory_mib);
  visit("job_time", options.job_time_s);
  visit("stall_time", options.stall_time_s);
  visit("queue_limit", options.queue_limit);
  visit("transfers", options.transfers);
  visit("model_budget_mib", options.model_budget_mib);
  visit("precompute", options.precompute_program);
  visit("executor", options.executor);
  visit("slurm_dir", options.slurm_directory);
  visit("slurm_partition", options.slurm_partition);
  visit("slurm_upload", options.slurm_upload);
  visit("slurm_client", options.slurm_client);
  visit("slurm_tls_roots", options.slurm_tls_roots);
}

}  // namespace carillon
