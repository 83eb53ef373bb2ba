#include "base/text.h"

#include <cstdint>
#include <limits>
#include <locale>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "base/time.h"

namespace visual_localization {
namespace {

TEST(Joined, PutsTheSeparatorBetween) {
  EXPECT_EQ(joined(std::vector<std::string>{}), "");
  EXPECT_EQ(joined(std::vector<std::string>{"one"}), "one");
  EXPECT_EQ(joined(std::set<std::string>{"b", "a", "c"}), "a, b, c");
  EXPECT_EQ(joined(std::vector<std::string>{"", "", "x"}, ";"), ";;x");
}

TEST(Csv, AFieldIsQuotedWhereItNeedsToBe) {
  EXPECT_EQ(csvField("plain text"), "plain text");
  EXPECT_EQ(csvField("a,b"), "\"a,b\"");
  EXPECT_EQ(csvField("two\nlines"), "two lines");
  EXPECT_EQ(csvField("say \"a\""), "\"say \"\"a\"\"\"");
  EXPECT_EQ(csvQuoted("plain"), "\"plain\"");
  EXPECT_EQ(csvQuoted(""), "\"\"");
}

TEST(Csv, ASpreadsheetRunsNoField) {
  for (const char* text : {"=cmd|'/C calc'!A0", "+1+cmd", "-2+3", "@SUM(A1)"}) {
    EXPECT_EQ(csvField(text), std::string("'") + text);
    EXPECT_EQ(csvQuoted(text), std::string("\"'") + text + '"');
  }
  EXPECT_EQ(csvField("\t=1+1"), " =1+1");
  for (const char* number : {"-1.5", "+3", "-1e-9", "7"}) EXPECT_EQ(csvField(number), number);
  EXPECT_EQ(csvField("a-b"), "a-b");
}

TEST(Csv, ALineHasAFieldMoreThanCommas) {
  using Fields = std::vector<std::string>;
  EXPECT_EQ(csvFields("a,bc,d"), (Fields{"a", "bc", "d"}));
  EXPECT_EQ(csvFields(",a,,"), (Fields{"", "a", "", ""}));
  EXPECT_EQ(csvFields(""), Fields{""});
}

/// Writes numbers as no file may have them.
struct Commas : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(NumberStream, ReadsBackAsTheSameNumberWhateverTheLocale) {
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Commas));
  for (const double number : {1.0 / 3.0, -2.0e-7, 1234567.875, 6378137.000000001}) {
    auto out = numberStream();
    out << number;
    EXPECT_EQ(std::stod(out.str()), number) << out.str();
  }
  auto out = numberStream(3);
  out << 1234567 << ' ' << 2.0 / 3.0;
  EXPECT_EQ(out.str(), "1234567 0.667");
  std::locale::global(before);
}

TEST(SecondsText, HasAllNineDecimals) {
  EXPECT_EQ(secondsText(0), "0.000000000");
  EXPECT_EQ(secondsText(1226500000123456789), "1226500000.123456789");
  EXPECT_EQ(secondsText(1'000'000'007), "1.000000007");
  EXPECT_EQ(secondsText(-500'000'000), "-0.500000000");
  EXPECT_EQ(secondsText(std::numeric_limits<std::int64_t>::min()), "-9223372036.854775808");
}

}  // namespace
}  // namespace visual_localization
