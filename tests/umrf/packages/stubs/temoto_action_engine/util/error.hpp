#pragma once
#include <exception>
#include <string>

#define CREATE_TEMOTO_ERROR_STACK(message) TemotoErrorStack(message, __func__)
#define FORWARD_TEMOTO_ERROR_STACK(error_stack) error_stack.appendError("forwarding", __func__)

class TemotoErrorStack : public std::exception
{
public:
  TemotoErrorStack(std::string message, std::string origin);
  TemotoErrorStack appendError(std::string message, std::string origin);
};
