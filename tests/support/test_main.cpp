/// The main function of the test programs.
#include <gtest/gtest.h>

int main(int argc, char** argv) {
  constexpr int kAllSkipped =
      77;  // with which CTest shows a group as skipped (tests/CMakeLists.txt)
  testing::InitGoogleTest(&argc, argv);
  const int failed = RUN_ALL_TESTS();
  const testing::UnitTest& tests = *testing::UnitTest::GetInstance();
  const bool anyRan = tests.skipped_test_count() < tests.test_to_run_count();
  return failed || anyRan || tests.test_to_run_count() == 0 ? failed : kAllSkipped;
}
