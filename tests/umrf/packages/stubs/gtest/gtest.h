#pragma once

#define TEST(suite, name) static void suite##_##name(); \
  void (*suite##_##name##_pointer)() = suite##_##name; \
  static void suite##_##name()
#define EXPECT_EQ(one, other) static_cast<void>((one) == (other))
