#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "base/text.h"

namespace visual_localization {
namespace {

const std::string kAll = "a\xC3\xA4\xE2\x82\xAC\xF0\x9F\x9A\x97";  // characters of 1, 2, 3 and 4 bytes

TEST(Utf8, CharactersBeginWhereTheyBegin) {
  const std::size_t expected[] = {1, 2, 0, 3, 0, 0, 4, 0, 0, 0};
  for (std::size_t at = 0; at < kAll.size(); ++at) EXPECT_EQ(characterBytes(kAll, at), expected[at]) << at;
}

TEST(Utf8, WhatIsNoCharacter) {
  for (const char* text :
       {"\x80", "\xBF", "\xC0\x80", "\xC1\xBF", "\xC3", "\xC3z", "\xE0\x9F\xBF", "\xE2\x82", "\xE2\x82z",
        "\xED\xA0\x80", "\xF0\x8F\xBF\xBF", "\xF0\x9F\x9A", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFF"}) {
    EXPECT_EQ(characterBytes(text, 0), 0U) << text;
  }
  for (const char* text :
       {"\xC2\x80", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_EQ(characterBytes(text, 0), std::string(text).size()) << text;
  }
}

TEST(Utf8, NoCharacterIsCutInTwo) {
  for (std::size_t most = 0; most <= kAll.size() + 1; ++most) {
    for (const std::string& part : {kAll.substr(0, characterBorder(kAll, most)), lastCharacters(kAll, most)}) {
      EXPECT_LE(part.size(), most);
      EXPECT_GT(part.size() + 4, std::min(most, kAll.size()));
      for (std::size_t at = 0; at < part.size(); at += characterBytes(part, at)) {
        ASSERT_NE(characterBytes(part, at), 0U) << most;
      }
    }
  }
}

TEST(Utf8, WhatIsNoUtf8IsCutAnywhere) {
  const std::string text(10, '\x80');
  for (std::size_t most = 0; most <= text.size(); ++most) {
    EXPECT_EQ(characterBorder(text, most), most);
    EXPECT_EQ(lastCharacters(text, most).size(), most);
  }
}

TEST(OneLine, ShowsNothingThatATerminalObeys) {
  EXPECT_EQ(oneLine("a\x1b[31mb\x07\x7f"), "a [31mb  ");
  EXPECT_EQ(oneLine("a\xC2\x9B"
                    "31mb"),
            "a 31mb")
      << "U+009B begins a sequence as ESC [ does";
  EXPECT_EQ(oneLine("txt.\xE2\x80\xAEnab"), "txt.?nab") << "U+202E turns the rest around";
  EXPECT_EQ(oneLine("\xE2\x81\xA6\xE2\x80\x8B\xEF\xBB\xBF\xF3\xA0\x81\x81"), "????");
  EXPECT_EQ(oneLine("a\xE2\x80\xA8z"), "a?z") << "U+2028 ends a line";
}

TEST(OneLine, ShowsWhatIsNoUtf8AsQuestionMarks) {
  EXPECT_EQ(oneLine("a\x9B"
                    "31m\xFFz\xC3"),
            "a?31m?z?");
  EXPECT_EQ(oneLine("\xED\xA0\x80"), "???");
}

TEST(OneLine, LeavesLettersOfAllKinds) {
  EXPECT_EQ(oneLine(kAll), kAll);
  const std::string words =
      "Stra\xC3\x9F"
      "e \xD0\x94\xD0\xB0 \xE9\x81\x93 \xD7\xA9\xD7\x9C";
  EXPECT_EQ(oneLine(words), words);
}

TEST(OneLine, IsCutBetweenCharacters) {
  EXPECT_EQ(oneLine("a\nb\x1b", 10), "a b ");
  EXPECT_EQ(oneLine("abc", 2), "ab");
  EXPECT_EQ(oneLine("a\xC3\xA4z", 2), "a");
  EXPECT_EQ(oneLine("a\xC3\xA4z", 3), "a\xC3\xA4");
}

}  // namespace
}  // namespace visual_localization
