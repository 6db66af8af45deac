// SPDX-License-Identifier: Apache-2.0
// The open assets and their levels: opened, loaded when rays need them, released when a plan drops them.
//
// What the budget pays for, besides the levels: instance records, the host's BVH over them, the tables of open assets.
// Between frames apply() first gives back what the new plan does not allow, so what it does allow always fits.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "bvh/bvh_device.h"
#include "bvh/traced_asset.h"
#include "cache/loader_thread.h"
#include "cache/residency.h"
#include "lodselect/planner.h"
#include "runtime/messages.h"
#include "runtime/open_asset.h"

namespace farfield {

/// A stored level of an open asset.
struct LevelSlot {
  uint32_t asset;
  uint32_t slot;
};

/// serve() and stats() are safe from any thread while rays fly; the rest is for one thread, between frames.
class LevelStore final : public LevelSource {
 public:
  LevelStore(std::unique_ptr<BvhDevice> device, const RuntimeOptions& options, Messages& messages);
  ~LevelStore() override;

  // Rays
  const TracedLevel* serve(uint32_t asset, uint32_t slot) override;
  const TracedMorph* serve_morph(uint32_t asset, uint32_t slot) override;
  void refuse_nested() override;

  // Between frames
  /// The asset in a (canonical) folder, opened with its root if it is not yet. Errors: those of Runtime::open_asset.
  Result<uint32_t> open(const std::filesystem::path& folder, MaterialFunction materials);
  size_t asset_count() const { return assets_.size(); }
  const OpenAsset& asset(uint32_t i) const { return *assets_[i]; }

  /// What all instances take, here and in the host's scene. Where that has no room beside what is loaded, all but the
  /// roots is given back. Errors: OutOfBudget (the former number stays).
  Result<void> set_instance_bytes(uint64_t bytes);
  /// What the budget pays for besides levels and textures.
  uint64_t fixed_bytes() const;
  /// A budget for these (canonical) folders and instances that take so many bytes. Errors: those of read_asset.
  static Result<uint64_t> least_bytes(std::span<const std::filesystem::path> folders, Blend blend,
                                      uint64_t instance_bytes);

  /// What the cache of textures wants if the plan shows textured sources up close; 0 if it does not.
  uint64_t wanted_texture_bytes(const Plan& plan) const;
  /// Says, once, that close-ups go without textures, and what would do.
  void report_no_room_for_textures(const Error& error);

  /// Sizes and numbers of an asset's levels, as if it had no instance.
  PlanAsset plan_asset(uint32_t i) const { return plan_asset(*assets_[i]); }
  /// Ends what progressive rays have asked for, so that sizes no longer change, and begins no more loads ahead.
  void stop_loading();
  /// Allows what the plan allows and gives back the rest; the cache of textures gets this much.
  void apply(const Plan& plan, uint64_t texture_bytes);
  /// Loads those of the levels that the plan allows, several at a time where their builds fit; in progressive mode only
  /// asks for them, in this order.
  void load(std::span<const LevelSlot> wanted);
  /// The same for their morphs to the next, whose levels were loaded before.
  void load_morphs(std::span<const LevelSlot> wanted);
  /// Starts to load levels for a plan to come, where the plan in force leaves room. Rays do not see them. Also while
  /// rays fly.
  void load_ahead(std::span<const LevelSlot> wanted);
  /// Whether that plan leaves any.
  bool has_ahead_room() const { return ahead_room_bytes_ > 0; }

  ResidencyStats stats() const { return levels_.stats(); }
  /// Of all levels: LevelRecord::fallbacks.
  uint64_t fallbacks() const;
  std::vector<LevelRecord> level_stats(uint32_t asset) const;

 private:
  struct ItemOwner {
    OpenAsset* asset;
    uint32_t slot;
    bool is_morph;
  };

  PlanAsset plan_asset(const OpenAsset& asset) const;
  void add_items(OpenAsset& asset);
  void add_item(OpenAsset& asset, uint32_t slot, bool is_morph, std::vector<size_t>& numbers);
  Result<void> load_root(OpenAsset& asset);
  const TracedLevel* find_level(OpenAsset& asset, uint32_t slot, bool& may_ask);
  const TracedMorph* find_morph(OpenAsset& asset, uint32_t slot);
  /// An item that is there, or that may be waited for; else it is asked for, if may_ask, which is false from then on.
  const Resident* find(size_t item, bool& may_ask);
  Result<Plan> plan_roots(const OpenAsset* newcomer) const;
  void count_freed(uint64_t bytes);
  void report_broken(size_t item, const Error& error);
  void for_each_at_once(std::span<const LevelSlot> wanted, const std::function<void(const LevelSlot&)>& load_one);
  std::vector<LevelSlot> largest_first(std::span<const LevelSlot> wanted) const;
  uint64_t largest_peak_to_come() const;
  void stop_ahead();

  const uint64_t budget_bytes_;
  const Residency residency_;
  const Blend blend_;
  const float blend_window_;
  Messages& messages_;
  TextureCache textures_;
  uint64_t texture_bytes_ = 0;  ///< that the plan in force gives textures_
  uint64_t instance_bytes_ = 0;
  uint64_t table_bytes_ = 0;  ///< of assets_
  std::unique_ptr<BvhDevice> device_;
  std::vector<std::unique_ptr<OpenAsset>> assets_;
  std::vector<std::unique_ptr<OpenAsset>> refused_;  ///< did not open; items of levels_ refer to them
  std::vector<ItemOwner> item_owners_;
  std::optional<Error> opening_error_;  ///< why the root of the asset being opened did not load
  const OpenAsset* opening_ = nullptr;
  ResidentSet levels_;
  std::atomic<bool> said_no_room_{false};
  std::atomic<bool> said_nested_{false};
  std::atomic<uint64_t> freed_bytes_{0};  ///< since the last malloc_trim; relaxed: a counter
  uint64_t ahead_room_bytes_ = 0;         ///< that the plan in force leaves beside all it allows, build peaks aside
  LoaderThread loader_;                   ///< these last: they stop before anything else goes
  LoaderThread ahead_;
};

}  // namespace farfield
