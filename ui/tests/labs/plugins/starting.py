from busflow import TRANSIENT_LOCAL, Node, Parameters, on_parameters, publisher, service
from busflow_assistant.messages import AskText, AssistantState


class StartingParameters(Parameters):
    host: str = ""


class Starting(Node):
    # An assistant that says what it is when it is given a host.

    parameters: StartingParameters
    state = publisher(AssistantState, "assistant/state", qos=TRANSIENT_LOCAL)

    async def start(self) -> None:
        self.log.info("it starts")

    @on_parameters
    def read(self, _old: StartingParameters) -> None:
        self.state.publish(AssistantState(pages=1, engine="extractive", host=self.parameters.host, model="m"))

    @service(AskText, "assistant/ask")
    def ask(self, _request: AskText.Request) -> AskText.Response:
        return AskText.Response()
