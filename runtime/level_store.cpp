// SPDX-License-Identifier: Apache-2.0
#include "runtime/level_store.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "base/parallel.h"

namespace farfield {

namespace {

// Device, geometry, loader, tables of the runtime itself, and what malloc keeps of small blocks.
constexpr uint64_t kRuntimeBytes = 256 * 1024;
// The allocator is asked to give memory back once this share of the budget was freed. Not after every load: in a host
// with a large heap that costs milliseconds.
constexpr uint64_t kTrimShare = 64;

}  // namespace

LevelStore::LevelStore(std::unique_ptr<BvhDevice> device, const RuntimeOptions& options, Messages& messages)
    : budget_bytes_(options.budget_bytes),
      residency_(options.residency),
      blend_(options.blend),
      blend_window_(options.blend_window),
      messages_(messages),
      textures_(messages),
      device_(std::move(device)),
      levels_(options.budget_bytes, [this](size_t item, const Error& error) { report_broken(item, error); }),
      loader_([this](size_t item) { levels_.acquire(item); }),
      ahead_([this](size_t item) { levels_.load_ahead(item); }, LoaderThread::Priority::Low) {}

LevelStore::~LevelStore() { stop_ahead(); }

const TracedLevel* LevelStore::serve(uint32_t asset_index, uint32_t slot) {
  OpenAsset& asset = *assets_[asset_index];
  bool may_ask = true;
  for (uint32_t served = slot; served < asset.traced.slot_count(); ++served) {
    if (const TracedLevel* level = find_level(asset, served, may_ask)) {
      if (served != slot) asset.fallbacks[slot].fetch_add(1, std::memory_order_relaxed);
      return level;
    }
  }
  return nullptr;
}

const TracedMorph* LevelStore::serve_morph(uint32_t asset_index, uint32_t slot) {
  OpenAsset& asset = *assets_[asset_index];
  const TracedMorph* morph = find_morph(asset, slot);
  if (!morph) asset.fallbacks[slot].fetch_add(1, std::memory_order_relaxed);
  return morph;
}

void LevelStore::refuse_nested() {
  messages_.report_once(
      said_nested_, Severity::Error,
      "the scene that holds Farfield's geometry is instanced by another: rays see nothing of it there; "
      "attach() to the scene that rays start in, with the instance's transform in local_to_world");
}

const TracedMorph* LevelStore::find_morph(OpenAsset& asset, uint32_t slot) {
  bool may_ask = true;
  const bool has_levels = find_level(asset, slot + 1, may_ask) && find_level(asset, slot, may_ask);
  const Resident* resident = has_levels ? find(asset.morph_items[slot], may_ask) : nullptr;
  if (!resident) return nullptr;
  const TracedMorph* morph = static_cast<const LoadedMorph*>(resident)->traced.get();
  asset.traced.morphs[slot].store(morph, std::memory_order_release);
  return morph;
}

const TracedLevel* LevelStore::find_level(OpenAsset& asset, uint32_t slot, bool& may_ask) {
  const Resident* resident = find(asset.items[slot], may_ask);
  if (!resident) return nullptr;
  const TracedLevel* level = static_cast<const LoadedLevel*>(resident)->traced.get();
  asset.traced.loaded[slot].store(level, std::memory_order_release);
  return level;
}

const Resident* LevelStore::find(size_t item, bool& may_ask) {
  if (residency_ == Residency::Wait) return levels_.acquire(item);
  const Resident* resident = levels_.try_acquire(item);
  if (!resident && may_ask && levels_.state(item) == ItemState::Empty) {
    loader_.request(item);
    may_ask = false;
  }
  return resident;
}

Result<uint32_t> LevelStore::open(const std::filesystem::path& folder, MaterialFunction materials) {
  for (uint32_t i = 0; i < assets_.size(); ++i) {
    if (assets_[i]->folder == folder) return i;
  }
  loader_.forget();  // these threads must not meet tables that grow, nor take the room of the root
  stop_ahead();
  FARFIELD_TRY_LET(auto asset, read_asset(folder, std::move(materials), textures_));
  if (auto root = load_root(*asset); !root) {
    refused_.push_back(std::move(asset));
    return tl::unexpected(root.error());
  }
  asset->traced.blend_window = blend_window_;
  asset->traced.finest_blended = std::exp2(-blend_window_);
  asset->traced.usable_slots = {static_cast<uint8_t>(asset->traced.slot_count() - 1)};  // until a plan says otherwise
  table_bytes_ += asset->table_bytes();
  assets_.push_back(std::move(asset));
  levels_.set_other_bytes(fixed_bytes() + texture_bytes_);
  return static_cast<uint32_t>(assets_.size() - 1);
}

void LevelStore::add_item(OpenAsset& asset, uint32_t slot, bool is_morph, std::vector<size_t>& numbers) {
  ResidencyItem item = is_morph ? make_morph_item(asset, slot, *device_) : make_level_item(asset, slot, *device_);
  item.load = [this, load = std::move(item.load)](const LoadTerms& terms) {
    Result<LoadedItem> loaded = load(terms);
    if (loaded) count_freed(loaded->build_peak_bytes);
    return loaded;
  };
  numbers.push_back(levels_.add(std::move(item)));
  item_owners_.push_back({&asset, slot, is_morph});
}

void LevelStore::add_items(OpenAsset& asset) {
  const uint32_t count = asset.traced.slot_count();
  asset.fallbacks = std::make_unique<std::atomic<uint64_t>[]>(count);
  for (uint32_t slot = 0; slot < count; ++slot) add_item(asset, slot, false, asset.items);
  if (blend_ == Blend::Morph) {
    for (uint32_t slot = 0; slot < count; ++slot) {
      if (asset.morph_costs[slot]) {
        add_item(asset, slot, true, asset.morph_items);
      } else {
        asset.morph_items.push_back(kNoItem);
      }
    }
    if (std::ranges::count(asset.morph_items, kNoItem) > 1) {  // the root has none
      messages_.report(
          Severity::Warning,
          fmt::format("{}: its levels dissolve: it was baked before morphs were measured; bake it again", asset.name));
    }
  }
  loader_.resize(levels_.size());
  ahead_.resize(levels_.size());
}

Result<void> LevelStore::load_root(OpenAsset& asset) {
  add_items(asset);
  // Roots come first: what an earlier plan has loaded beside them may be in the way, and the next plan decides anew.
  FARFIELD_TRY_LET(const auto plan, plan_roots(&asset));
  const size_t root = asset.items.back();
  const uint64_t needed = levels_.resident_bytes(root) + levels_.build_peak_bytes(root) + asset.table_bytes();
  if (levels_.stats().accounted_bytes + needed > budget_bytes_) apply(plan, 0);

  opening_ = &asset;
  opening_error_.reset();
  const bool is_loaded = levels_.acquire(root) != nullptr;
  opening_ = nullptr;
  if (!is_loaded) return tl::unexpected(*opening_error_);
  return {};
}

/// The plan in which all assets, and the one that is being opened, have nothing but their roots.
Result<Plan> LevelStore::plan_roots(const OpenAsset* newcomer) const {
  std::vector<PlanAsset> wanted;
  for (const auto& asset : assets_) wanted.push_back(plan_asset(*asset));
  if (newcomer) wanted.push_back(plan_asset(*newcomer));
  auto plan = plan_levels(wanted, budget_bytes_, fixed_bytes() + (newcomer ? newcomer->table_bytes() : 0));
  if (plan && newcomer) plan->usable.pop_back();  // apply() knows it not yet
  return plan;
}

Result<void> LevelStore::set_instance_bytes(uint64_t bytes) {
  const auto fits = [&] { return levels_.stats().accounted_bytes - instance_bytes_ + bytes <= budget_bytes_; };
  if (bytes > instance_bytes_ && has_ahead_room()) {
    levels_.set_ahead_room(ahead_room_bytes_ = 0);  // what would begin now does not know of these bytes
    if (!fits()) stop_ahead();
  }
  if (!fits()) {
    const uint64_t former = std::exchange(instance_bytes_, bytes);
    const Result<Plan> roots = plan_roots(nullptr);
    instance_bytes_ = former;
    if (!roots) return tl::unexpected(roots.error());
    apply(*roots, 0);
  }
  instance_bytes_ = bytes;
  levels_.set_other_bytes(fixed_bytes() + texture_bytes_);
  return {};
}

Result<uint64_t> LevelStore::least_bytes(std::span<const std::filesystem::path> folders, Blend blend,
                                         uint64_t instance_bytes) {
  Messages silent({});
  TextureCache textures(silent);
  uint64_t bytes = kRuntimeBytes + instance_bytes, largest_peak = 0;
  for (const std::filesystem::path& folder : folders) {
    FARFIELD_TRY_LET(const auto asset, read_asset(folder, {}, textures));
    if (blend == Blend::Morph) asset->morph_items.resize(asset->levels.size());  // as add_items() does
    bytes += asset->table_bytes() + asset->levels.back().resident_bytes;
    largest_peak = std::max(largest_peak, asset->build_peak_bytes.back());
  }
  return bytes + largest_peak;
}

PlanAsset LevelStore::plan_asset(const OpenAsset& asset) const {
  PlanAsset wanted;
  for (const size_t item : asset.items) {
    const bool is_lost = levels_.state(item) == ItemState::Broken;  // a coarser one serves: it takes nothing
    wanted.resident_bytes.push_back(is_lost ? 0 : levels_.resident_bytes(item));
    wanted.build_peak_bytes.push_back(is_lost ? 0 : levels_.build_peak_bytes(item));
  }
  for (const size_t item : asset.morph_items) {
    const bool is_there = item != kNoItem && levels_.state(item) != ItemState::Broken;
    wanted.morphs.push_back(
        is_there ? std::optional<MorphSize>({levels_.resident_bytes(item), levels_.build_peak_bytes(item)})
                 : std::nullopt);
  }
  wanted.lambda = asset.traced.level_numbers;
  wanted.ray_cost = asset.ray_cost;
  return wanted;
}

uint64_t LevelStore::wanted_texture_bytes(const Plan& plan) const {
  for (size_t i = 0; i < plan.usable.size(); ++i) {
    const OpenAsset& asset = *assets_[i];
    const bool shows_source = asset.levels[plan.finest(i)].level == 0;
    if (shows_source && asset.close_up->has_textures()) return textures_.wanted_bytes(budget_bytes_);
  }
  return 0;
}

void LevelStore::report_no_room_for_textures(const Error& error) {
  messages_.report_once(
      said_no_room_, Severity::Warning,
      fmt::format("close-ups have one colour per face, their textures do not fit: {}", error.message));
}

void LevelStore::stop_loading() {
  loader_.forget();
  ahead_.clear();
}

void LevelStore::apply(const Plan& plan, uint64_t texture_bytes) {
  stop_loading();
  levels_.set_ahead_room(0);  // nothing begins that the plan may not want
  std::vector<size_t> planned;
  for (size_t i = 0; i < plan.usable.size(); ++i) {
    for (const uint8_t slot : plan.usable[i]) planned.push_back(assets_[i]->items[slot]);
  }
  std::ranges::sort(planned);
  levels_.drop_ahead(planned);

  std::vector<size_t> dropped;
  for (size_t i = 0; i < plan.usable.size(); ++i) {
    OpenAsset& asset = *assets_[i];
    asset.traced.usable_slots = plan.usable[i];
    asset.traced.morphing_slots = plan.morphs[i];
    const auto is_refused = [&](size_t item) { return levels_.state(item) == ItemState::Refused; };
    for (uint32_t slot = 0; slot < asset.traced.slot_count(); ++slot) {      // no ray in flight
      if (!asset.traced.is_usable(slot) || is_refused(asset.items[slot])) {  // this plan may have room for it
        asset.traced.loaded[slot].store(nullptr, std::memory_order_relaxed);
        dropped.push_back(asset.items[slot]);
      }
      if (asset.morph_items.empty() || asset.morph_items[slot] == kNoItem) continue;
      if (!asset.traced.may_morph(slot) || is_refused(asset.morph_items[slot])) {
        asset.traced.morphs[slot].store(nullptr, std::memory_order_relaxed);
        dropped.push_back(asset.morph_items[slot]);
      }
    }
  }
  const uint64_t before = levels_.stats().accounted_bytes;
  levels_.release(dropped);
  count_freed(before - levels_.stats().accounted_bytes);
  texture_bytes_ = texture_bytes;
  textures_.set_bytes(texture_bytes);
  levels_.set_other_bytes(fixed_bytes() + texture_bytes_);
  const uint64_t in_use = fixed_bytes() + texture_bytes_ + plan.resident_bytes;
  ahead_room_bytes_ = budget_bytes_ - std::min(budget_bytes_, in_use);
}

/// Of what the plan allows and rays have not asked for yet.
uint64_t LevelStore::largest_peak_to_come() const {
  uint64_t largest = 0;
  const auto look_at = [&](size_t item) {
    if (item != kNoItem && levels_.state(item) == ItemState::Empty)
      largest = std::max(largest, levels_.build_peak_bytes(item));
  };
  for (const auto& asset : assets_) {
    for (const uint8_t slot : asset->traced.usable_slots) look_at(asset->items[slot]);
    for (const uint8_t slot : asset->traced.morphing_slots) look_at(asset->morph_items[slot]);
  }
  return largest;
}

/// So that the long ones do not come last, alone.
std::vector<LevelSlot> LevelStore::largest_first(std::span<const LevelSlot> wanted) const {
  std::vector<LevelSlot> sorted(wanted.begin(), wanted.end());
  std::ranges::stable_sort(sorted, std::greater(),
                           [&](const LevelSlot& level) { return assets_[level.asset]->levels[level.slot].file_bytes; });
  return sorted;
}

void LevelStore::for_each_at_once(std::span<const LevelSlot> wanted,
                                  const std::function<void(const LevelSlot&)>& load_one) {
  std::atomic<size_t> next{0};  // relaxed: it only hands out levels, in their order
  parallel_for(wanted.size(), 1,
               [&](size_t, size_t) { load_one(wanted[next.fetch_add(1, std::memory_order_relaxed)]); });
}

void LevelStore::load(std::span<const LevelSlot> wanted) {
  std::vector<LevelSlot> usable;
  for (const LevelSlot& level : wanted) {
    if (assets_[level.asset]->traced.is_usable(level.slot)) usable.push_back(level);
  }
  const auto item_of = [&](const LevelSlot& level) { return assets_[level.asset]->items[level.slot]; };
  if (residency_ == Residency::Progressive) {
    for (const LevelSlot& level : usable) loader_.request(item_of(level));
  } else {
    for_each_at_once(largest_first(usable), [&](const LevelSlot& level) { levels_.acquire(item_of(level)); });
  }
}

void LevelStore::load_morphs(std::span<const LevelSlot> wanted) {
  for_each_at_once(largest_first(wanted), [&](const LevelSlot& level) {
    OpenAsset& asset = *assets_[level.asset];
    if (asset.traced.may_morph(level.slot)) find_morph(asset, level.slot);
  });
}

void LevelStore::load_ahead(std::span<const LevelSlot> wanted) {
  ahead_.clear();
  levels_.set_ahead_room(ahead_room_bytes_ - std::min(ahead_room_bytes_, largest_peak_to_come()));
  for (const LevelSlot& level : largest_first(wanted)) ahead_.request(assets_[level.asset]->items[level.slot]);
}

/// Nothing is being loaded ahead afterwards, and nothing that was is left.
void LevelStore::stop_ahead() {
  levels_.set_ahead_room(ahead_room_bytes_ = 0);
  ahead_.clear();
  levels_.drop_ahead();
  ahead_.forget();
}

uint64_t LevelStore::fallbacks() const {
  uint64_t sum = 0;
  for (const auto& asset : assets_) {
    for (uint32_t slot = 0; slot < asset->traced.slot_count(); ++slot)
      sum += asset->fallbacks[slot].load(std::memory_order_relaxed);
  }
  return sum;
}

std::vector<LevelRecord> LevelStore::level_stats(uint32_t asset_index) const {
  const OpenAsset& asset = *assets_[asset_index];
  std::vector<LevelRecord> stats;
  for (uint32_t slot = 0; slot < asset.traced.slot_count(); ++slot) {
    const size_t item = asset.items[slot];
    const ItemState state = levels_.state(item);
    const ItemStats loaded = levels_.item_stats(item);
    stats.push_back({loaded.loads, loaded.load_seconds,
                     state == ItemState::Ready ? levels_.resident_bytes(item) : uint64_t{0},
                     asset.fallbacks[slot].load(std::memory_order_relaxed),
                     state == ItemState::Broken || state == ItemState::Refused, asset.traced.is_usable(slot)});
  }
  return stats;
}

uint64_t LevelStore::fixed_bytes() const { return kRuntimeBytes + instance_bytes_ + table_bytes_; }

/// Builds and releases leave holes in the heap, which `ps` still counts.
void LevelStore::count_freed(uint64_t bytes) {
  const uint64_t freed = freed_bytes_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  if (freed < budget_bytes_ / kTrimShare) return;
  freed_bytes_.store(0, std::memory_order_relaxed);
  malloc_trim(0);
}

void LevelStore::report_broken(size_t item, const Error& error) {
  const ItemOwner& owner = item_owners_[item];
  if (owner.asset == opening_) {
    opening_error_ = error;  // open_asset() returns it
    return;
  }
  const uint32_t level = owner.asset->levels[owner.slot].level;
  messages_.report(
      error.code == ErrorCode::OutOfBudget ? Severity::Warning : Severity::Error,
      owner.is_morph ? fmt::format("{}: level {} dissolves into the next: {}", owner.asset->name, level, error.message)
                     : fmt::format("{}: level {} is left out, a coarser one serves in its place: {}", owner.asset->name,
                                   level, error.message));
}

}  // namespace farfield
