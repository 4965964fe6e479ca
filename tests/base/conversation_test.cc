// A program that answers line by line: answers, ends, hangs.
#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include "base/worker_pool.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

using Trouble = Conversation::Trouble;

WorkerJob Shell(const test::TestFolder& folder, const std::string& script) {
  return {.argv = {"/bin/sh", "-c", script}, .log = folder.PathOf("log")};
}

TEST(Conversation, KeepsItsProgram) {
  const test::TestFolder folder("conversation");
  Conversation program(
      Shell(folder, "n=0; while read line; do n=$((n+1)); echo \"$n $line\"; done"));
  EXPECT_FALSE(program.running());
  EXPECT_EQ(program.Call("a", 10).line, "1 a");
  EXPECT_TRUE(program.running());
  EXPECT_EQ(program.Call(std::string(200000, 'b'), 10).line, "2 " + std::string(200000, 'b'));
}

TEST(Conversation, SaysHowItsProgramEnded) {
  const test::TestFolder folder("conversation");
  Conversation ends(Shell(folder, "read line; exit 7"));
  Conversation::Answer answer = ends.Call("a", 10);
  EXPECT_EQ(answer.trouble, Trouble::kEnded);
  EXPECT_EQ(answer.how, "ended with exit code 7");
  EXPECT_FALSE(ends.running());
  // The next call starts it again.
  EXPECT_EQ(ends.Call("a", 10).trouble, Trouble::kEnded);
  Conversation killed(Shell(folder, "read line; kill -9 $$"));
  EXPECT_EQ(killed.Call("a", 10).how, "was ended by signal 9");
  Conversation none({.argv = {"/no/such/program"}, .log = folder.PathOf("log")});
  EXPECT_EQ(none.Call("a", 10).trouble, Trouble::kNotStarted);
}

TEST(Conversation, DoesNotWaitForever) {
  const test::TestFolder folder("conversation");
  Conversation hangs(Shell(folder, "exec sleep 100"));
  const Conversation::Answer answer = hangs.Call("a", 0.2);
  EXPECT_EQ(answer.trouble, Trouble::kTimedOut);
  EXPECT_EQ(answer.how, "took longer than 0.2 s");
  EXPECT_FALSE(hangs.running());
  // One that reads nothing, and more than a pipe takes.
  EXPECT_EQ(hangs.Call(std::string(4000000, 'a'), 0.2).trouble, Trouble::kTimedOut);
}

TEST(Conversation, IsNotSharedWithAForkedProcess) {
  const test::TestFolder folder("conversation");
  Conversation program(Shell(folder, "while read line; do echo \"$$ $line\"; done"));
  const std::string ours = program.Call("a", 10).line;
  const pid_t child = fork();
  if (child == 0) _exit(program.Call("a", 10).line == ours ? 1 : 0);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(program.Call("a", 10).line, ours);
}

}  // namespace
}  // namespace mbv
