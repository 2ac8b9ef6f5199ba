// SPDX-License-Identifier: BSD-3-Clause

// Our messages against the OpenIGTLink library's own.

#include <gtest/gtest.h>

#ifdef DYOP_HAS_OPENIGTLINK
#include <arpa/inet.h>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlMath.h>
#include <igtlTransformMessage.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <random>
#include <thread>

#include "dyop/io/transform_stream.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

igtl::TransformMessage::Pointer message_of_library(const RigidPose& X) {
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      matrix[row][column] = float(X.rotation()(row, column));
    }
    matrix[row][3] = float(X.translation()[row]);
  }
  igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
  message->SetDeviceName("Stylus");
  message->SetMatrix(matrix);
  message->Pack();
  return message;
}

TEST(TransformInterop, AMessageOfTheLibraryArrivesOverUdp) {
  std::mt19937_64 random(3);
  TransformLink link(0);
  const int sender = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(link.port());
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (int k = 0; k < 20; ++k) {
    const RigidPose X = testing::random_pose(200, random);
    const igtl::TransformMessage::Pointer message = message_of_library(X);
    const auto size = std::size_t(message->GetPackSize());
    ASSERT_EQ(::sendto(sender, message->GetPackPointer(), size, 0,
                       reinterpret_cast<const sockaddr*>(&to), sizeof(to)),
              ssize_t(size));
    const auto received = link.receive();
    ASSERT_TRUE(received.has_value());
    EXPECT_EQ(received->name, "Stylus");
    EXPECT_TRUE(received->pose.translation().isApprox(X.translation(), 1e-6));
    EXPECT_TRUE(received->pose.rotation().isApprox(X.rotation(), 1e-6));
  }
  ::close(sender);
}

// As a viewer does: images and transforms over one connection, and an answer to each transform.
TEST(TransformInterop, TalksWithAClientOfTheLibraryOverTcp) {
  std::mt19937_64 random(5);
  TransformStream stream(0);
  igtl::ClientSocket::Pointer client = igtl::ClientSocket::New();
  ASSERT_EQ(client->ConnectToServer("127.0.0.1", int(stream.port())), 0);
  client->SetReceiveTimeout(5000);  // milliseconds
  igtl::ImageMessage::Pointer image = igtl::ImageMessage::New();
  image->SetDimensions(300, 300, 2);
  image->SetScalarTypeToUint8();
  image->SetDeviceName("Ultrasound");
  image->AllocateScalars();
  std::memset(image->GetScalarPointer(), 7, std::size_t(image->GetImageSize()));
  image->Pack();
  for (int k = 0; k < 20; ++k) {
    const RigidPose X = testing::random_pose(200, random);
    std::thread sender([&] {
      client->Send(image->GetPackPointer(), image->GetPackSize());
      const igtl::TransformMessage::Pointer message = message_of_library(X);
      client->Send(message->GetPackPointer(), message->GetPackSize());
    });
    std::optional<TransformMessage> received;
    for (int wait = 0; wait < 5000 && !received; ++wait) {
      received = stream.receive();
      if (!received) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    sender.join();
    ASSERT_TRUE(received);
    EXPECT_TRUE(received->pose.translation().isApprox(X.translation(), 1e-6));
    EXPECT_EQ(stream.send({"Tool", X}), 1);
    igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    header->InitPack();
    ASSERT_EQ(client->Receive(header->GetPackPointer(), header->GetPackSize()),
              header->GetPackSize());
    ASSERT_NE(header->Unpack() & igtl::MessageHeader::UNPACK_HEADER, 0);
    igtl::TransformMessage::Pointer answer = igtl::TransformMessage::New();
    answer->SetMessageHeader(header);
    answer->AllocatePack();
    client->Receive(answer->GetPackBodyPointer(), answer->GetPackBodySize());
    ASSERT_NE(answer->Unpack(1) & igtl::MessageHeader::UNPACK_BODY, 0);
    igtl::Matrix4x4 matrix;
    answer->GetMatrix(matrix);
    for (int row = 0; row < 3; ++row) EXPECT_EQ(matrix[row][3], float(X.translation()[row]));
  }
  client->CloseSocket();
}

TEST(TransformInterop, TheLibraryReadsOurMessage) {
  std::mt19937_64 random(4);
  for (int k = 0; k < 20; ++k) {
    const RigidPose X = testing::random_pose(200, random);
    const auto bytes = pack_transform({"Tool", X});
    igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    header->InitPack();
    const auto head = std::size_t(header->GetPackSize());
    std::memcpy(header->GetPackPointer(), bytes.data(), head);
    ASSERT_NE(header->Unpack() & igtl::MessageHeader::UNPACK_HEADER, 0);
    EXPECT_STREQ(header->GetDeviceName(), "Tool");
    igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    ASSERT_EQ(std::size_t(message->GetPackBodySize()), bytes.size() - head);
    std::memcpy(message->GetPackBodyPointer(), bytes.data() + head, bytes.size() - head);
    ASSERT_NE(message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY, 0);  // and its checksum
    igtl::Matrix4x4 matrix;
    message->GetMatrix(matrix);
    for (int row = 0; row < 3; ++row) {
      EXPECT_EQ(matrix[row][3], float(X.translation()[row]));
      for (int column = 0; column < 3; ++column) {
        EXPECT_EQ(matrix[row][column], float(X.rotation()(row, column)));
      }
    }
  }
}

}  // namespace
}  // namespace dyop

#else

TEST(TransformInterop, WithTheLibrary) {
  GTEST_SKIP() << "runs where libopenigtlink-dev is installed: bash .ci/install.sh test";
}

#endif
