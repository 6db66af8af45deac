// SPDX-License-Identifier: Apache-2.0
// trade.json and trade.html.
#include "evaluate/trade_page.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <regex>

#include "base/base64.h"
#include "evaluate/trade_json.h"
#include "tests/support/sample_trade.h"

namespace farfield {
namespace {

using Json = nlohmann::json;

TEST(TradeJson, HasEverySettingUnderEveryLight) {
  const Json json = Json::parse(to_json(test::sample_trade()));
  EXPECT_EQ(json["scene"], "forest & <lake>.glb");
  EXPECT_EQ(json["frames"], Json({0, 10}));
  EXPECT_EQ(json["parts"], 4);
  ASSERT_EQ(json["settings"].size(), 4u);
  EXPECT_EQ(json["settings"][0]["knob"], "full_detail");
  EXPECT_EQ(json["settings"][1]["knob"], "base");
  EXPECT_EQ(json["settings"][3]["knob"], "pixel_error");
  EXPECT_EQ(json["settings"][3]["pixel_error"], 2.0);
  for (const Json& setting : json["settings"]) {
    ASSERT_EQ(setting["lights"].size(), 2u);
    EXPECT_EQ(setting["lights"][0]["light"], "own");
    EXPECT_EQ(setting["lights"][1]["light"], "turned");
    for (const Json& light : setting["lights"]) {
      for (const char* key :
           {"color_bias", "color_rms", "color_error", "bounds", "standard_errors", "variance", "variance_ratio",
            "cpu_seconds", "cpu_ratio", "noise_at_equal_time", "time_to_equal_error", "seconds", "load_seconds",
            "peak_accounted_bytes", "peak_rss_bytes", "pop", "changes"})
        EXPECT_TRUE(light.contains(key)) << key;
      ASSERT_EQ(light["frames"].size(), 2u);
      for (const char* key : {"cpu_seconds", "color_rms", "variance", "variance_ratio", "time_to_equal_error"})
        EXPECT_TRUE(light["frames"][0].contains(key)) << key;
      EXPECT_EQ(light["frames"][1]["frame"], 10);
    }
  }
  ASSERT_EQ(json["advice"].size(), 4u);
  for (const Json& advice : json["advice"]) EXPECT_FALSE(advice["text"].get<std::string>().empty());
}

TEST(TradeJson, IsNullWhereAFigureIsUnknownAndWhereNoTimeWouldDo) {
  Trade trade = test::sample_trade();
  trade.rows[1].lights[0].errors.all.color_rms[0] = {std::nullopt, 0.0, 0.5, 0};
  trade.rows[2].lights[0].errors.all.color_rms[0] = {0.4, 0.39, 0.41, 0};  // noise is 0.1
  const Json json = Json::parse(to_json(trade));
  const Json &unknown = json["settings"][1]["lights"][0], &never = json["settings"][2]["lights"][0];
  EXPECT_TRUE(unknown["color_rms"].is_null());
  EXPECT_TRUE(unknown["time_to_equal_error"].is_null());
  EXPECT_TRUE(unknown["reaches_equal_error"].is_null());
  EXPECT_EQ(unknown["bounds"]["color_rms"], Json({0.0, 0.5}));
  EXPECT_TRUE(never["time_to_equal_error"].is_null());
  EXPECT_EQ(never["reaches_equal_error"], false);
  EXPECT_EQ(json["settings"][3]["lights"][0]["reaches_equal_error"], false);
  EXPECT_EQ(json["settings"][0]["lights"][0]["reaches_equal_error"], true);
}

TEST(Base64, IsThatOfTheRfc) {  // RFC 4648, section 10
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) EXPECT_EQ(base64(bytes), text);
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

/// Every element is closed in order, every attribute is quoted, no character stands that XML does not allow.
void expect_well_formed(std::string page) {
  ASSERT_EQ(page.rfind("<!DOCTYPE html>\n", 0), 0u);
  page.erase(0, page.find('\n'));
  const std::regex tag(R"re(<(/?)([a-zA-Z0-9]+)((?: [a-zA-Z0-9:-]+="[^"<]*")*)(/?)>)re");
  std::vector<std::string> open;
  size_t from = 0;
  for (std::sregex_iterator it(page.begin(), page.end(), tag), end; it != end; ++it) {
    const std::string between = page.substr(from, static_cast<size_t>(it->position()) - from);
    EXPECT_EQ(between.find_first_of("<>"), std::string::npos) << between;
    from = static_cast<size_t>(it->position() + it->length());
    if ((*it)[4] == "/") continue;
    if ((*it)[1] != "/") {
      open.push_back((*it)[2]);
      continue;
    }
    ASSERT_FALSE(open.empty()) << it->str();
    EXPECT_EQ(open.back(), (*it)[2]);
    open.pop_back();
  }
  EXPECT_TRUE(open.empty());
  const std::regex loose_ampersand("&(?!(amp|lt|gt|quot);)");
  EXPECT_FALSE(std::regex_search(page, loose_ampersand));
}

TEST(TradePage, IsWellFormedAndNeedsNoOtherFile) {
  Trade trade = test::sample_trade();
  trade.warnings = {"a \"budget\" < 5 & more", "line\nbreak"};
  trade.rows[2].lights[0].errors.all.color_rms[0] = {std::nullopt, 0.0, 0.5, 0};
  trade.rows[2].lights[1].errors.all.color_rms[0].value = std::numeric_limits<double>::infinity();
  const std::string page = trade_page(trade, {{1, 0, 10, "full", "level", "difference"}});
  expect_well_formed(page);
  for (const char* part : {"Which knob for which wish", "less noise", "less memory", "faster", "closer", "<svg ",
                           "forest &amp; &lt;lake&gt;.glb", "data:image/png;base64,bGV2ZWw=", "unknown",
                           "the sun turned about", "Error over CPU time"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  for (const char* outside : {"href=", "src=\"http", "@import", "<script", "url("})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  EXPECT_EQ(page.find("nan"), std::string::npos);
  EXPECT_LT(page.find("Which knob for which wish"), page.find("<h2>Figures"));
}

TEST(TradePage, OfOneFrameUnderOneLightHasNoChanges) {
  Trade trade = test::sample_trade();
  trade.frames = {0};
  for (TradeRow& row : trade.rows) {
    row.lights.pop_back();
    row.lights[0].errors.frames.pop_back();
    row.lights[0].cost.frame_cpu_seconds.pop_back();
    row.lights[0].changes.clear();
    row.lights[0].pop = {};
  }
  const std::string page = trade_page(trade, {});
  expect_well_formed(page);
  EXPECT_EQ(page.find("Change from frame to frame"), std::string::npos);
  EXPECT_FALSE(Json::parse(to_json(trade))["settings"][1]["lights"][0].contains("pop"));
}

}  // namespace
}  // namespace farfield
