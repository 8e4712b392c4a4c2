"""What several tests of xbot bridge share."""

from solfer.middleware.bridge import Bridge, BridgeSearch, Route, ServiceForward
from solfer.middleware.shared_memory.discovery import declared_topics, published_topics, services


def made(namespace, inside, outside, inwards, outwards):
    """Make a bridge as the node does."""

    def desired(known):
        published = {each.topic for each in published_topics(namespace)}
        return [Route(each.topic, each.message) for each in declared_topics(namespace, (*known, *published))]

    return Bridge(
        inside,
        outside,
        inwards,
        outwards,
        search=BridgeSearch(
            lambda known: [
                ServiceForward(each.name, each.interface, each.request, each.reply)
                for each in services(namespace, known)
            ],
            lambda known: [Route(each.topic, each.message) for each in published_topics(namespace, known)],
            desired,
        ),
    )
