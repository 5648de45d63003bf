#pragma once
#include <any>

namespace boost
{
class any
{
public:
  any() = default;
  any(const any&) = default;
  any& operator=(const any&) = default;
  template <class T>
  any(const T& value) : value_(value)
  {
  }
  bool empty() const
  {
    return !value_.has_value();
  }
  template <class T>
  T as() const
  {
    return std::any_cast<T>(value_);
  }

private:
  std::any value_;
};

template <class T>
T any_cast(const any& value)
{
  return value.as<T>();
}
}  // namespace boost
