// States at which rows are asked for, and the answer.
#include "external/motion_text.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <nlohmann/json.hpp>

namespace mbv {
namespace {

constexpr const char* kAnswer =
    R"({"messages": ["m"], "equalities": ["close:a", "drive:b"],
        "states": [{"R": [1, 2], "bias": [3, 4], "force": [5]}]})";

TEST(RowStates, AreHandedOverInFull) {
  const RowState state{.qpos = Vec3(0.1, 2, 3),
                       .qvel = Vec3(4, 5, 6),
                       .targets = VecX::Constant(1, 7),
                       .applied = Vec3(8, 9, 10)};
  const auto json = nlohmann::json::parse(StatesJson({"b"}, {state, state}));
  EXPECT_EQ(json["drives"], nlohmann::json({"b"}));
  ASSERT_EQ(json["states"].size(), 2U);
  EXPECT_EQ(json["states"][1]["qpos"][0], 0.1);
  EXPECT_EQ(json["states"][1]["qvel"][2], 6);
  EXPECT_EQ(json["states"][1]["targets"][0], 7);
  EXPECT_EQ(json["states"][1]["applied"][1], 9);
}

TEST(RowStates, AnAnswerIsRead) {
  std::string trouble;
  const auto answer = ReadRowAnswer(kAnswer, 1, 1, &trouble);
  ASSERT_TRUE(answer) << trouble;
  EXPECT_EQ(answer->messages, std::vector<std::string>{"m"});
  EXPECT_EQ(answer->equalities[1], "drive:b");
  EXPECT_EQ(answer->states[0].R[1], 2.0);
  EXPECT_EQ(answer->states[0].bias[0], 3.0);
  EXPECT_EQ(answer->states[0].force[0], 5.0);
}

TEST(RowStates, WhatDoesNotFitIsNotAnAnswer) {
  std::string trouble;
  EXPECT_FALSE(ReadRowAnswer(kAnswer, 2, 1, &trouble));
  EXPECT_NE(trouble.find("does not fit"), std::string::npos);
  EXPECT_FALSE(ReadRowAnswer(kAnswer, 1, 2, &trouble));
  const std::string text = kAnswer;
  for (const char* wrong : {"", "{}", "[]", "nonsense"}) {
    EXPECT_FALSE(ReadRowAnswer(wrong, 1, 1, &trouble)) << wrong;
    EXPECT_NE(trouble.find("rows.json is not an answer"), std::string::npos) << trouble;
  }
  std::string short_row = text;
  short_row.replace(short_row.find("[1, 2]"), 6, "[1]");
  EXPECT_FALSE(ReadRowAnswer(short_row, 1, 1, &trouble));
  std::string short_bias = text;
  short_bias.replace(short_bias.find("[3, 4]"), 6, "[3]");
  EXPECT_FALSE(ReadRowAnswer(short_bias, 1, 1, &trouble));
  std::string no_number = text;
  no_number.replace(no_number.find("[3, 4]"), 6, "[3, null]");
  EXPECT_FALSE(ReadRowAnswer(no_number, 1, 1, &trouble));
}

}  // namespace
}  // namespace mbv
