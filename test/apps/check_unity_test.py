"""check_unity.py: which names it takes for private ones."""
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(sys.argv[1])))
from check_unity import private_names  # noqa: E402

SOURCE = """
class Outside {};
namespace {

using Alias = int;
class Derived : public std::runtime_error {
  int member_ = 0;
};
struct Final final {
};
enum class Kind { kA, kB };
constexpr double kNumber_m = 3.0;
const char kText[] = "a(b)";
std::atomic<bool> flag{false};
int counter;

/// A comment about nothing(here).
template <class T>
std::vector<T> made(const T& from) {
  return {from};
}

void done(int number, const std::string& text = {}) {
}

TEST(Suite, Name) {
}

}  // namespace
"""


class PrivateNamesTest(unittest.TestCase):
    """On a source that has one of each."""

    def test_each_kind_of_definition_is_found(self):
        names = ['Derived', 'Final', 'Kind', 'kNumber_m', 'kText', 'flag', 'counter', 'made', 'done']
        self.assertEqual(private_names(SOURCE), {**dict.fromkeys(names, ''), 'Alias': 'int'})

    def test_what_is_not_private_is_none(self):
        self.assertEqual(private_names('class A {};\nint b = 0;\n'), {})


if __name__ == '__main__':
    del sys.argv[1:]
    unittest.main()
