// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/schema.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/integrators/integrator.h"
#include "engine/laws/interaction.h"
#include "engine/run/observable.h"

namespace carom::schema_test {
namespace {

TEST(Schema, KnowsEveryDeclaredParameter) {
  for (const IntegratorInfo& info : integrators()) {
    const Variant* variant = table_schema("integrator").variant(info.name);
    ASSERT_NE(variant, nullptr) << info.name;
    ASSERT_EQ(variant->keys.size(), info.parameters.size());
    for (std::size_t n = 0; n < info.parameters.size(); ++n) EXPECT_EQ(variant->keys[n].name, info.parameters[n].name);
  }
  for (const InteractionInfo& info : interactions()) {
    const Variant* variant = table_schema("interaction").variant(info.name);
    ASSERT_NE(variant, nullptr) << info.name;
    EXPECT_EQ(variant->keys.size(), info.parameters.size());
  }
  const auto& output = table_schema("output").keys;
  for (const ObservableInfo& info : observables())
    for (const Parameter& parameter : info.parameters)
      EXPECT_EQ(std::ranges::count(output, output_key(info, parameter.name), &Parameter::name), 1) << info.name;
}

TEST(Schema, PagesShowEveryKey) {
  const std::string plain = schema_page(false), markdown = schema_page(true), methods = methods_page();
  for (const TableSchema& table : deck_schema()) {
    const auto shown = [&](const std::vector<Parameter>& keys) {
      for (const Parameter& key : keys) {
        EXPECT_NE(plain.find(key.name + ": "), std::string::npos) << key.name;
        EXPECT_NE(markdown.find("| `" + key.name + "` |"), std::string::npos) << key.name;
      }
    };
    shown(table.keys);
    for (const Variant& variant : table.variants) shown(variant.keys);
  }
  for (const IntegratorInfo& info : integrators()) {
    EXPECT_NE(methods.find(std::string(info.name) + " – " + std::string(info.title)), std::string::npos);
    EXPECT_NE(methods.find("order:     " + std::string(info.order)), std::string::npos);
  }
  for (const ObservableInfo& info : observables()) {
    EXPECT_NE(methods.find(std::string(info.name) + ".csv – " + std::string(info.title)), std::string::npos);
    for (const Parameter& parameter : info.parameters)
      EXPECT_NE(methods.find("    " + output_key(info, parameter.name) + ": "), std::string::npos) << parameter.name;
  }
}

TEST(Schema, EveryKeyOfItsOwnHasAMeaningOrAUnit) {
  for (const TableSchema& table : deck_schema())
    for (const Parameter& key : table.keys) EXPECT_FALSE(key.meaning.empty() && key.unit == "-") << key.name;
}

}  // namespace
}  // namespace carom::schema_test
