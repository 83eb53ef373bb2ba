#pragma once
// What a place with mutants asks; lab/mutants.py copies it into the sources that it mutates.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <type_traits>
#include <utility>

#include <Eigen/Core>

namespace mutation {

inline constexpr int kMost = 1 << 16;  // as in mutants.py

struct State {
  int active = -1;
  const char* log = nullptr;
  bool reached[kMost] = {};

  State() : log(std::getenv("MUTANTS_REACHED")) {
    if (const char* text = std::getenv("MUTANT")) active = std::atoi(text);
  }
  ~State() {
    if (log == nullptr) return;
    std::FILE* file = std::fopen(log, "a");
    if (file == nullptr) return;
    for (int id = 0; id < kMost; ++id) {
      if (reached[id]) std::fprintf(file, "%d\n", id);
    }
    std::fclose(file);
  }
};
inline State state;

inline bool on(int id) {
  if (state.log != nullptr) state.reached[id] = true;
  return id == state.active;
}

inline bool truth(int id, bool value) { return on(id) ? !value : value; }
inline bool forced(int id, bool to, bool value) { return on(id) ? to : value; }

template <class T>
T constant(int id, T value) {
  if (!on(id)) return value;
  if constexpr (std::is_floating_point_v<T>) return value == T(0) ? T(1) : value * T(2);
  else return static_cast<T>(value + 1);
}
inline bool constant(int id, bool value) { return on(id) ? !value : value; }

#define MUTATION_COMPARISON(name, op, boundary, opposite)                       \
  template <class A, class B>                                                   \
  bool name(int id, const A& a, const B& b) {                                   \
    if (on(id)) return a boundary b;                                            \
    if (on(id + 1)) return a opposite b;                                        \
    return a op b;                                                              \
  }
MUTATION_COMPARISON(less, <, <=, >=)
MUTATION_COMPARISON(lessEqual, <=, <, >)
MUTATION_COMPARISON(greater, >, >=, <=)
MUTATION_COMPARISON(greaterEqual, >=, >, <)
#undef MUTATION_COMPARISON
template <class A, class B>
bool equal(int id, const A& a, const B& b) { return on(id) ? !(a == b) : a == b; }
template <class A, class B>
bool unequal(int id, const A& a, const B& b) { return on(id) ? a == b : a != b; }

#define MUTATION_ARITHMETIC(name, op, other)                                                                \
  template <class A, class B, std::enable_if_t<std::is_arithmetic_v<A> && std::is_arithmetic_v<B>, int> = 0> \
  auto name(int id, A a, B b) { return on(id) ? a other b : a op b; }
MUTATION_ARITHMETIC(plus, +, -)
MUTATION_ARITHMETIC(minus, -, +)
MUTATION_ARITHMETIC(times, *, /)
MUTATION_ARITHMETIC(over, /, *)
#undef MUTATION_ARITHMETIC
template <class A, class B>
typename A::PlainObject plus(int id, const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return on(id) ? (a - b).eval() : (a + b).eval();
}
template <class A, class B>
typename A::PlainObject minus(int id, const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return on(id) ? (a + b).eval() : (a - b).eval();
}
template <class A, class B>
void add(int id, A&& a, const B& b) { if (on(id)) a -= b; else a += b; }
template <class A, class B>
void subtract(int id, A&& a, const B& b) { if (on(id)) a += b; else a -= b; }
template <class A, class B>
void scale(int id, A&& a, const B& b) { if (on(id)) a /= b; else a *= b; }

template <class T>
T negative(int id, T value) { return on(id) ? value : -value; }

struct Max {
  int id;
  template <class T> T operator()(const T& a, const T& b) const { return on(id) ? std::min(a, b) : std::max(a, b); }
};
struct Min {
  int id;
  template <class T> T operator()(const T& a, const T& b) const { return on(id) ? std::max(a, b) : std::min(a, b); }
};
struct Clamp {
  int id;
  template <class T> T operator()(const T& value, const T& low, const T& high) const {
    if (on(id)) return std::min(value, high);
    if (on(id + 1)) return std::max(value, low);
    return std::clamp(value, low, high);
  }
};
struct Abs {
  int id;
  template <class T> T operator()(T value) const { return on(id) ? value : std::abs(value); }
};

}  // namespace mutation
